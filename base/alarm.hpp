// SPDX-License-Identifier: MIT
// A problem that is reported once when it begins and once when it ends.
#pragma once

#include <string>
#include <utility>

namespace prism {

class Alarm {
 public:
  /// Sets the current problem; empty: none. Returns true if it is to be reported: it begins, becomes another one, or
  /// ends.
  bool set(std::string problem) { return std::exchange(problem_, std::move(problem)) != problem_; }
  /// The same, but a change to another problem is not reported.
  bool set_state(std::string problem) {
    const bool was_active = is_active();
    problem_ = std::move(problem);
    return is_active() != was_active;
  }
  void clear() { problem_.clear(); }

  bool is_active() const { return !problem_.empty(); }
  const std::string& problem() const { return problem_; }

 private:
  std::string problem_;
};

}  // namespace prism
