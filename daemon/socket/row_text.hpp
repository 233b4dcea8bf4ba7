// SPDX-License-Identifier: MIT
// Buffer for the JSON of many rows, and functions that write a row with its axis.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "compensation/compensated.hpp"

namespace prism::socket {

/// A growing buffer. Rows are written directly into it, without a copy.
class RowText {
 public:
  /// Returns the end of the text, with space for `most` more characters. Valid until the next call.
  char* room(std::size_t most) {
    if (capacity_ - size_ < most) grow(most);
    return text_.get() + size_;
  }
  /// Sets the end of the text, within the space that room() returned.
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

/// Start of a row's JSON for put_row(): {"axis":"x"
std::string row_head(std::string_view axis);

/// Writes a row as JSON, starting with its axis. `at` must have space for `head` and compensation::kJsonChars.
char* put_row(char* at, std::string_view head, const compensation::Compensated& row);
/// Appends a row as JSON, starting with its axis.
void append_row(std::string& text, std::string_view axis, const compensation::CompensatedWindow& row);

}  // namespace prism::socket
