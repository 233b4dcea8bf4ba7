// SPDX-License-Identifier: MIT
#include "tools/prismrelay/state.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "base/text_number.hpp"

namespace prism::prismrelay {

double host_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

void log_line(Level level, const std::string& text) {
  static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  static constexpr const char* kNames[] = {"", "", "", "error", "warning", "", "info"};
  const int number = static_cast<int>(level);
  if (journal) return fmt::print(stderr, "<{}>{}\n", number, printable(text));
  fmt::print(stderr, "{} prismrelay {}: {}\n", utc_text(static_cast<std::int64_t>(host_time_s())), kNames[number],
             printable(text));
}

void RelayState::up(const std::string& target) {
  const std::lock_guard lock(mutex_);
  TargetState& current = view_.targets[target];
  current.error.clear();
  if (std::exchange(current.up, true)) return;
  current.since_s = host_time_s();
  const std::uint64_t repeats = std::exchange(current.repeats, 0);
  log_line(Level::kInfo, target + ": connected" +
                             (repeats > 0 ? fmt::format("; the last error was repeated {} times", repeats) : ""));
}

void RelayState::down(const std::string& target, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  TargetState& current = view_.targets[target];
  ++current.failures;
  if (current.up || current.since_s == 0) current.since_s = host_time_s();
  const bool changed = std::exchange(current.up, false) || current.error != printable(reason);
  current.error = printable(reason);
  if (!changed) return void(++current.repeats);
  const std::uint64_t repeats = std::exchange(current.repeats, 0);
  log_line(Level::kWarning, reason + "; retrying" +
                                (repeats > 0 ? fmt::format(" (the error before was repeated {} times)", repeats) : ""));
}

void RelayState::committed(const std::string& target) {
  const std::lock_guard lock(mutex_);
  view_.targets[target].committed_s = host_time_s();
}

void RelayState::dropped(const std::string& target, std::uint64_t count) {
  const std::lock_guard lock(mutex_);
  view_.targets[target].dropped += count;
}

void RelayState::instance(const std::string& gyro, const std::string& socket, const std::string& state,
                          const std::string& error) {
  const std::lock_guard lock(mutex_);
  const auto [found, is_new] = view_.instances.try_emplace(gyro);
  InstanceState& current = found->second;
  current.socket = socket;
  const bool changed = is_new || current.state != state || (current.error != printable(error) && !error.empty());
  current.state = state;
  current.error = printable(error);
  if (state != "running") current.status = nullptr;
  if (changed)
    log_line(state == "gone" && !is_new ? Level::kWarning : Level::kInfo,
             fmt::format("{}: {}{}{}", gyro, state, error.empty() ? "" : ": ", error));
}

void RelayState::status(const std::string& gyro, nlohmann::json response) {
  const std::lock_guard lock(mutex_);
  if (const auto found = view_.instances.find(gyro); found != view_.instances.end())
    found->second.status = std::move(response);
}

void RelayState::forget(const std::string& gyro) {
  const std::lock_guard lock(mutex_);
  if (view_.instances.erase(gyro) != 0) log_line(Level::kInfo, gyro + ": socket removed, gyro no longer followed");
}

void RelayState::log_skipped(const std::string& name, const std::string& reason) {
  constexpr std::size_t kMaxNames = 1000;
  const std::lock_guard lock(mutex_);
  if (skipped_.size() < kMaxNames && skipped_.insert(name).second)
    log_line(Level::kWarning, fmt::format("{}: skipped: {}", name, reason));
}

void RelayState::log_skipped_axis(const std::string& gyro, const std::string& axis) {
  log_skipped(fmt::format("{} axis {}", gyro, axis), fmt::format("expected {}", rule_text(TextRule::kAxisName)));
}

RelayState::View RelayState::view() const {
  const std::lock_guard lock(mutex_);
  return view_;
}

bool RelayState::all_progress(std::size_t loops, std::chrono::seconds timeout) const {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  for (std::size_t i = 0; i < loops; ++i) {
    if (now - std::chrono::steady_clock::duration(progress_[i].load()) > timeout) return false;
  }
  return true;
}

}  // namespace prism::prismrelay
