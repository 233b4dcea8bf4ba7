// SPDX-License-Identifier: MIT
#include "compensation/text_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace prism {

std::string separators_problem(const std::string& separators) {
  constexpr const char* kExpected = "expected the characters between two columns, such as \",;\\t\"";
  if (separators.empty()) return fmt::format("is empty, {}", kExpected);
  const bool has_letter =
      std::any_of(separators.begin(), separators.end(), [](unsigned char c) { return std::isalnum(c) != 0; });
  return has_letter ? fmt::format("found \"{}\", {}", separators, kExpected) : std::string();
}

}  // namespace prism
