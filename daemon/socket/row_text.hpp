// SPDX-License-Identifier: MIT
// The text of rows: of many, written in place; and of one with its axis.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "compensation/compensated.hpp"

namespace prism::socket {

/// A std::string that hands out room at its end: a row is written once, where it is sent from.
class RowText {
 public:
  /// The end of the text, with room for `most` further characters behind it. Valid until the next call.
  char* room(std::size_t most) {
    if (capacity_ - size_ < most) grow(most);
    return text_.get() + size_;
  }
  /// What was written ends at `end`, within the room that was handed out.
  void end_at(const char* end) { size_ = static_cast<std::size_t>(end - text_.get()); }
  void clear() { size_ = 0; }
  std::string_view view() const { return {text_.get(), size_}; }

 private:
  void grow(std::size_t most) {
    capacity_ = std::max(2 * capacity_, size_ + most);
    std::unique_ptr<char[]> larger(new char[capacity_]);
    if (size_ > 0) std::memcpy(larger.get(), text_.get(), size_);
    text_ = std::move(larger);
  }

  std::unique_ptr<char[]> text_;
  std::size_t size_ = 0, capacity_ = 0;
};

/// What stands before a row's JSON for put_row(): {"axis":"x"
std::string row_head(std::string_view axis);

/// A row as JSON, its axis first. `at` has room for `head` and compensation::kJsonChars.
char* put_row(char* at, std::string_view head, const compensation::Compensated& row);
/// The same, appended.
void append_row(std::string& text, std::string_view axis, const compensation::CompensatedWindow& row);

}  // namespace prism::socket
