// SPDX-License-Identifier: MIT
#include "tools/prismrelay/state.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "base/text_number.hpp"

namespace prism::prismrelay {

double host_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

void say(Level level, const std::string& text) {
  static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  static constexpr const char* kNames[] = {"", "", "", "error", "warning", "", "info"};
  const int number = static_cast<int>(level);
  if (journal) return fmt::print(stderr, "<{}>{}\n", number, printable(text));
  fmt::print(stderr, "{} prismrelay {}: {}\n", utc_text(static_cast<std::int64_t>(host_time_s())), kNames[number],
             printable(text));
}

void RelayState::up(const std::string& target) {
  const std::lock_guard lock(mutex_);
  TargetState& own = view_.targets[target];
  own.error.clear();
  if (std::exchange(own.up, true)) return;
  own.since_s = host_time_s();
  say(Level::kInfo, target + ": connected");
}

void RelayState::down(const std::string& target, const std::string& why) {
  const std::lock_guard lock(mutex_);
  TargetState& own = view_.targets[target];
  ++own.failures;
  if (own.up || own.since_s == 0) own.since_s = host_time_s();
  const bool changed = std::exchange(own.up, false) || own.error != printable(why);
  own.error = printable(why);
  if (changed) say(Level::kWarning, why + "; trying again until it is there");
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
  const auto [place, is_new] = view_.instances.try_emplace(gyro);
  InstanceState& own = place->second;
  own.socket = socket;
  const bool changed = is_new || own.state != state || (own.error != printable(error) && !error.empty());
  own.state = state;
  own.error = printable(error);
  if (state != "running") own.status = nullptr;
  if (changed)
    say(state == "gone" && !is_new ? Level::kWarning : Level::kInfo,
        fmt::format("{}: {}{}{}", gyro, state, error.empty() ? "" : ": ", error));
}

void RelayState::status(const std::string& gyro, nlohmann::json answer) {
  const std::lock_guard lock(mutex_);
  if (const auto own = view_.instances.find(gyro); own != view_.instances.end()) own->second.status = std::move(answer);
}

void RelayState::forget(const std::string& gyro) {
  const std::lock_guard lock(mutex_);
  if (view_.instances.erase(gyro) != 0) say(Level::kInfo, gyro + ": its socket is gone, it is followed no more");
}

void RelayState::skipped(const std::string& what, const std::string& why) {
  constexpr std::size_t kMaxNames = 1000;
  const std::lock_guard lock(mutex_);
  if (skipped_.size() < kMaxNames && skipped_.insert(what).second)
    say(Level::kWarning, fmt::format("{}: skipped: {}", what, why));
}

void RelayState::skipped_axis(const std::string& gyro, const std::string& axis) {
  skipped(fmt::format("{} axis {}", gyro, axis), fmt::format("expected {}", rule_text(TextRule::kAxisName)));
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
