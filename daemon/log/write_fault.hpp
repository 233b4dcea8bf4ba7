// SPDX-License-Identifier: MIT
// A problem of a file that is written: counts what is dropped until it is over.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>
#include <utility>

#include "base/problems.hpp"

namespace prism::log {

/// Thread-safe.
class WriteFault {
 public:
  /// `what` is written, counted in `unit` ("log", "rows"); `dropped` is never reset. `problems` must outlive this.
  WriteFault(std::string what, const std::string& name, std::string unit, std::atomic<std::uint64_t>& dropped,
             Problems& problems)
      : what_(std::move(what)),
        key_(what_ + " " + name),
        unit_(std::move(unit)),
        dropped_(dropped),
        problems_(problems) {}

  void begin(const std::string& why) { lose(0, why); }

  /// `count` units were lost because of `why`.
  void lose(std::uint64_t count, const std::string& why) {
    dropped_ += count;
    problems_.set(key_,
                  {.kind = "disk",
                   .level = Problem::Level::kFailed,
                   .text = fmt::format("{}: {}; {} are dropped and counted until it works again", what_, why, unit_),
                   .unit = unit_,
                   .count = count});
  }

  /// `count` more because of the fault that is known.
  void drop(std::uint64_t count) {
    dropped_ += count;
    problems_.add(key_, count);
  }

  /// Data were synced. The fault ends at the second call without one in between, so that a disk that fails every other
  /// row is one fault.
  void synced() {
    const Problem known = problems_.find(key_);
    if (known.since_s != 0)
      problems_.clear(key_, fmt::format("{}: writing again after {} {} were dropped", what_, known.count, unit_), 2);
  }

 private:
  const std::string what_, key_, unit_;
  std::atomic<std::uint64_t>& dropped_;
  Problems& problems_;
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
