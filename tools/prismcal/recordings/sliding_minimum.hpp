// SPDX-License-Identifier: MIT
// The lower envelope of a series: the minimum of the values in a window that slides over it.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>

namespace prism::recordings {

/// Minimum over the last `length` values.
class SlidingMinimum {
 public:
  explicit SlidingMinimum(std::size_t length) : length_(length) {}
  void push(double value) {
    while (!values_.empty() && values_.back().second >= value) values_.pop_back();
    values_.emplace_back(count_++, value);
    drop_before(count_ > length_ ? count_ - length_ : 0);
  }
  /// Of values by their number, from 0.
  void drop_before(std::size_t number) {
    while (!values_.empty() && values_.front().first < number) values_.pop_front();
  }
  std::size_t count() const { return count_; }
  double value() const { return values_.front().second; }

 private:
  std::size_t length_, count_ = 0;
  std::deque<std::pair<std::size_t, double>> values_;
};

}  // namespace prism::recordings
