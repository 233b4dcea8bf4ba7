// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/document.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::report {
namespace {

Cell number_cell(std::optional<double> value, std::string text, Emphasis emphasis) {
  if (!value || !std::isfinite(*value)) return {kNothing, Emphasis::kMuted};
  return {std::move(text), value, emphasis};
}

}  // namespace

Column::Column(const char* text) : name(text), number(!name.ends_with(':')) {
  if (!number) name.pop_back();
  const std::size_t bracket = name.find(" [");
  if (bracket == std::string::npos) return;
  unit = name.substr(bracket + 2, name.size() - bracket - 3);
  name.resize(bracket);
}

Cell count_cell(std::size_t count) { return {fmt::format("{}", count), static_cast<double>(count)}; }

Cell fixed_cell(std::optional<double> value, int decimals, Emphasis emphasis) {
  std::string text = fmt::format("{:.{}f}", value.value_or(0), decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text[0] == '-') text.erase(0, 1);  // no −0.000
  return number_cell(value, std::move(text), emphasis);
}

Cell general_cell(std::optional<double> value, int digits, Emphasis emphasis) {
  return number_cell(value, fmt::format("{:.{}g}", value.value_or(0), digits), emphasis);
}

Cell percent_cell(std::optional<double> share, Emphasis emphasis) {
  return fixed_cell(share ? std::optional(100 * *share) : std::nullopt, 2, emphasis);
}

std::string id_or_number(const std::string& id, const char* kind, int number) {
  const bool plain = !id.empty() && id.size() <= 80 &&
                     id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string::npos;
  return plain ? id : fmt::format("{}-{}", kind, number);
}

}  // namespace prism::report
