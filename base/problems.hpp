// SPDX-License-Identifier: MIT
// Problems that exist now; each is reported once when it begins and once when it ends.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace prism {

struct Problem {
  enum class Level { kCaution, kFailed };  ///< failed: something is lost or must not be used

  std::string kind = {};  ///< event type, a fixed word
  std::string part = {};  ///< name of the part that has it; empty: the whole
  Level level = Level::kCaution;
  std::string text = {};     ///< one line
  std::string unit = {};     ///< of `count`
  std::uint64_t count = 0;   ///< since it began
  std::int64_t since_s = 0;  ///< host time
  int calm = 0;              ///< calls of clear() since the last set()

  /// The text, with the count: "log: … cannot be written: …; rows are dropped (240 rows since 2026-11-28T12:03:10Z)".
  std::string shown() const;
};

/// Thread-safe.
class Problems {
 public:
  /// Called with one line, on the thread that found the begin or the end.
  using Tell = std::function<void(bool begins, const std::string& kind, const std::string& text)>;
  explicit Problems(Tell tell) : tell_(std::move(tell)) {}

  /// The problem exists. Later calls only replace its text and level, and add to its count.
  void set(const std::string& key, Problem found);
  /// It does not exist. `text` is reported if this ends it. With `calls`, it ends after as many calls in a row, so that
  /// a problem that flickers is one; until then it is not listed.
  void clear(std::string_view key, std::string_view text, int calls = 1);
  /// Ends all of this kind; tells `prefix` and their texts.
  void clear_all(const std::string& kind, const std::string& prefix);
  /// Ends it without a word.
  void forget(std::string_view key);
  /// Adds to the count of a problem that exists.
  void add(std::string_view key, std::uint64_t count);

  bool empty() const {
    const std::lock_guard lock(mutex_);
    return problems_.empty();
  }
  bool has(std::string_view key) const {
    const std::lock_guard lock(mutex_);
    return problems_.contains(key);
  }
  /// A problem without text if it does not exist.
  Problem find(std::string_view key) const;
  /// Those that exist now: the failures first, else by key.
  std::vector<Problem> list() const;

 private:
  const Tell tell_;
  mutable std::mutex mutex_;
  std::map<std::string, Problem, std::less<>> problems_;
};

}  // namespace prism
