// SPDX-License-Identifier: MIT
#include "drivers/wire/description/printed_number.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "compensation/sample.hpp"

namespace prism::wire {

double parse_decimal(std::string_view text, char point) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  std::array<char, 64> copy;
  if (point != '.') {
    if (text.size() > copy.size() || text.find('.') != std::string_view::npos) return kUnknown;
    std::replace_copy(text.begin(), text.end(), copy.begin(), point, '.');
    text = {copy.data(), text.size()};
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::general);
  // from_chars accepts "inf" and "nan".
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(value) ? value : kUnknown;
}

}  // namespace prism::wire
