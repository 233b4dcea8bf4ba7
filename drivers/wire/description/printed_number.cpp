// SPDX-License-Identifier: MIT
#include "drivers/wire/description/printed_number.hpp"

#include <algorithm>
#include <array>

#include "base/text_number.hpp"
#include "compensation/sample.hpp"

namespace prism::wire {

double parse_decimal(std::string_view text, char point) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  if (text.starts_with('+')) {
    text.remove_prefix(1);
    if (text.starts_with('+') || text.starts_with('-')) return kUnknown;
  }
  std::array<char, 64> copy;
  if (point != '.') {
    if (text.size() > copy.size() || text.find('.') != std::string_view::npos) return kUnknown;
    std::replace_copy(text.begin(), text.end(), copy.begin(), point, '.');
    text = {copy.data(), text.size()};
  }
  return parse_number<double>(text).value_or(kUnknown);
}

}  // namespace prism::wire
