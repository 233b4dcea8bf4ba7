// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/document.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::report {
namespace {

Cell number_cell(std::optional<double> value, std::string text, Mark mark) {
  if (!value || !std::isfinite(*value)) return {kNothing, std::nullopt, Mark::kMuted};
  return {std::move(text), value, mark};
}

}  // namespace

Cell text_cell(std::string text, Mark mark) { return {std::move(text), std::nullopt, mark}; }

Cell fixed_cell(std::optional<double> value, int decimals, Mark mark) {
  std::string text = fmt::format("{:.{}f}", value.value_or(0), decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text[0] == '-') text.erase(0, 1);  // no −0.000
  return number_cell(value, std::move(text), mark);
}

Cell general_cell(std::optional<double> value, int digits, Mark mark) {
  return number_cell(value, fmt::format("{:.{}g}", value.value_or(0), digits), mark);
}

Cell percent_cell(std::optional<double> share, Mark mark) {
  return fixed_cell(share ? std::optional(100 * *share) : std::nullopt, 2, mark);
}

}  // namespace prism::report
