// SPDX-License-Identifier: MIT
// A rate per second.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace prism::recordings {

/// Seconds in increasing order, each with a rate or kUnknown.
class SecondSeries {
 public:
  void push(std::int64_t second, double rate);

  std::size_t size() const { return rates_.empty() ? count_ : rates_.size(); }
  bool empty() const { return size() == 0; }
  std::int64_t first_second() const { return runs_.front().second; }  ///< requires !empty()
  std::int64_t last_second() const;                                   ///< requires !empty()
  /// By index, < size().
  double rate(std::size_t index) const { return rates_[index]; }
  std::int64_t second(std::size_t index) const;
  /// The index of a second; nullopt if the series does not have it.
  std::optional<std::size_t> find(std::int64_t second) const;
  const std::vector<double>& rates() const { return rates_; }
  /// Frees the memory of the rates, which must not be read any more. The seconds remain.
  void drop_rates() {
    count_ = size();
    rates_ = {};
  }

  /// Calls visit(second, rate) for each in order: faster than by index.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for_each_of(0, size(), [&](std::size_t i, std::int64_t second) { visit(second, rates_[i]); });
  }
  /// Calls visit(i, second) for the seconds begin + i, i < count.
  template <class Visit>
  void for_each_of(std::size_t begin, std::size_t count, Visit&& visit) const {
    std::size_t run = run_of(begin);
    for (std::size_t i = 0; i < count; ++i) {
      while (run + 1 < runs_.size() && runs_[run + 1].index <= begin + i) ++run;
      visit(i, runs_[run].second + static_cast<std::int64_t>(begin + i - runs_[run].index));
    }
  }

 private:
  /// Consecutive seconds.
  struct Run {
    std::int64_t second = 0;
    std::size_t index = 0;  ///< of the first of them
  };
  std::size_t run_of(std::size_t index) const;  ///< index in runs_

  std::vector<double> rates_;
  std::size_t count_ = 0;  ///< of the rates, if they were dropped
  std::vector<Run> runs_;
};

}  // namespace prism::recordings
