// SPDX-License-Identifier: MIT
// Counts data dropped by write errors; reports the start and the end of an error once.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/host_time.hpp"
#include "daemon/pipeline/log_writers.hpp"

namespace prism::log {

/// Thread-safe.
class WriteErrorReporter {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// `what` is written, counted in `unit` ("log", "rows"); `dropped` is never reset. `tell` gets one line, on the
  /// thread that found the error.
  WriteErrorReporter(std::string what, std::string unit, std::atomic<std::uint64_t>& dropped, Tell tell)
      : what_(std::move(what)), unit_(std::move(unit)), dropped_(dropped), tell_(std::move(tell)) {}

  void begin(const std::string& why) {
    const std::lock_guard lock(mutex_);
    again_ = true;
    if (std::exchange(faulty_, true)) return;
    current_ = {why, host_time_ns() / 1'000'000'000, 0};
    tell_(fmt::format("{}: {}; {} are dropped and counted until it works again", what_, why, unit_));
  }

  void drop(std::uint64_t count) {
    const std::lock_guard lock(mutex_);
    again_ = true;
    dropped_ += count;
    current_.lost += count;
  }

  /// `count` units were lost because of `why`.
  void lose(std::uint64_t count, const std::string& why) {
    begin(why);
    drop(count);
  }

  /// Data were synced. An error ends at the second call without a drop in between, so that a disk that fails every
  /// other row is one error, not many.
  void synced() {
    const std::lock_guard lock(mutex_);
    if (!faulty_ || std::exchange(again_, false)) return;
    faulty_ = false;
    tell_(fmt::format("{}: writing again after {} {} were dropped", what_, current_.lost, unit_));
  }

  std::optional<pipeline::WriteError> current() const {
    const std::lock_guard lock(mutex_);
    return faulty_ ? std::optional(current_) : std::nullopt;
  }

 private:
  const std::string what_, unit_;
  std::atomic<std::uint64_t>& dropped_;
  const Tell tell_;
  mutable std::mutex mutex_;
  bool faulty_ = false, again_ = false;
  pipeline::WriteError current_;  ///< of faulty_
};

/// Exponential backoff of write attempts, in turns of about a second.
class ExponentialBackoff {
 public:
  static constexpr int kLongest = 60;

  /// Call once per turn. Returns true if an attempt is due.
  bool over() { return turns_ == 0 || --turns_ == 0; }
  void begin() { turns_ = pause_ = std::clamp(2 * pause_, 1, kLongest); }
  void end() { turns_ = pause_ = 0; }

 private:
  int pause_ = 0, turns_ = 0;
};

}  // namespace prism::log
