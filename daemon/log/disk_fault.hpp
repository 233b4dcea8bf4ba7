// SPDX-License-Identifier: MIT
// What the disk does not take: counted, told once when it begins, and once when the disk takes everything again.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

namespace prism::log {

/// Any thread may call it.
class DiskFault {
 public:
  using Tell = std::function<void(const std::string&)>;

  /// `what` is written, counted in `unit` ("log", "rows"); `dropped` counts for ever. `tell` takes one line, on the
  /// thread that found the fault.
  DiskFault(std::string what, std::string unit, std::atomic<std::uint64_t>& dropped, Tell tell)
      : what_(std::move(what)), unit_(std::move(unit)), dropped_(dropped), tell_(std::move(tell)) {}

  void begin(const std::string& why) {
    const std::lock_guard lock(mutex_);
    again_ = true;
    if (std::exchange(faulty_, true)) return;
    dropped_in_fault_ = 0;
    tell_(fmt::format("{}: {}; {} are dropped and counted until it works again", what_, why, unit_));
  }

  void drop(std::uint64_t count) {
    const std::lock_guard lock(mutex_);
    again_ = true;
    dropped_ += count;
    dropped_in_fault_ += count;
  }

  /// `count` were lost for this reason.
  void lose(std::uint64_t count, const std::string& why) {
    begin(why);
    drop(count);
  }

  /// What was written stands on the disk. A fault is over at the second call with nothing dropped in between: a disk
  /// that takes every other row is one fault, not many.
  void synced() {
    const std::lock_guard lock(mutex_);
    if (!faulty_ || std::exchange(again_, false)) return;
    faulty_ = false;
    tell_(fmt::format("{}: writing again after {} {} were dropped", what_, dropped_in_fault_, unit_));
  }

 private:
  const std::string what_, unit_;
  std::atomic<std::uint64_t>& dropped_;
  const Tell tell_;
  std::mutex mutex_;
  bool faulty_ = false, again_ = false;
  std::uint64_t dropped_in_fault_ = 0;
};

/// When to try again what the disk refused, in turns of a second each: the pause doubles with each refusal.
class RetryPause {
 public:
  static constexpr int kLongest = 60;

  /// A turn passed; true where the next try is due, or where nothing was refused.
  bool over() { return turns_ == 0 || --turns_ == 0; }
  void begin() { turns_ = pause_ = std::clamp(2 * pause_, 1, kLongest); }
  void end() { turns_ = pause_ = 0; }

 private:
  int pause_ = 0, turns_ = 0;
};

}  // namespace prism::log
