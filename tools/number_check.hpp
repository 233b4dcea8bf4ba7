// SPDX-License-Identifier: MIT
// Numbers on command lines: within bounds, and numbers at all.
#pragma once

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <cstdlib>
#include <limits>
#include <string>

namespace prism::tools {

/// Refuses what is no number from `least` to `most`, "nan" too, which CLI::Range and CLI::PositiveNumber let through.
inline CLI::Validator within(double least, double most, const std::string& expected) {
  const auto check = [least, most, expected](std::string& word) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (!word.empty() && *end == '\0' && number >= least && number <= most) return std::string();
    return fmt::format("found \"{}\", expected a number {}", word, expected);
  };
  return CLI::Validator(check, expected);
}

inline CLI::Validator within(double least, double most) {
  return within(least, most, fmt::format("within {} to {}", least, most));
}
inline CLI::Validator positive() {
  return within(std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), "above 0");
}
inline CLI::Validator not_negative() { return within(0, std::numeric_limits<double>::max(), "of 0 or more"); }

}  // namespace prism::tools
