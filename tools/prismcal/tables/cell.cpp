// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/cell.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>

namespace prism::tables {
namespace {

constexpr std::size_t kMaxNumberChars = 64;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::optional<double> plain_number(std::string_view cell) {
  if (cell.starts_with('+')) cell.remove_prefix(1);
  if (cell.starts_with('+')) return std::nullopt;
  double value = 0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data(), last, value);
  // "1." at the end of a cell is more often a sentence or a torn number than a number.
  if (error != std::errc() || end != last || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Removes the separators of groups. Returns false if the digits before the decimal sign are not groups of three.
bool without_groups(std::string_view cell, char decimal, std::string& out) {
  const char group = decimal == ',' ? '.' : ',';
  const std::size_t sign = cell.starts_with('-') || cell.starts_with('+') ? 1 : 0;
  const std::size_t stop = std::min(cell.find_first_of(std::string{decimal, 'e', 'E'}), cell.size());
  const std::size_t first = cell.find(group);
  if (first == std::string_view::npos || first > stop || first - sign < 1 || first - sign > 3) return false;
  std::size_t groups = 0;
  for (std::size_t at = first; at < stop; at += 4, ++groups) {
    if (cell[at] != group || at + 4 > stop) return false;
    if (!is_digit(cell[at + 1]) || !is_digit(cell[at + 2]) || !is_digit(cell[at + 3])) return false;
  }
  const bool certain = groups > 1 || (stop < cell.size() && cell[stop] == decimal);
  if (!certain || cell.find(group, stop) != std::string_view::npos) return false;
  out.clear();
  std::copy_if(cell.begin(), cell.end(), std::back_inserter(out), [&](char c) { return c != group; });
  return true;
}

bool equal_ignoring_case(std::string_view a, std::string_view lower) {
  return a.size() == lower.size() && std::equal(a.begin(), a.end(), lower.begin(), [](char x, char y) {
           return (x >= 'A' && x <= 'Z' ? static_cast<char>(x + 32) : x) == y;
         });
}

}  // namespace

std::optional<double> number_in(std::string_view cell, char decimal) {
  if (cell.empty() || cell.size() > kMaxNumberChars) return std::nullopt;
  constexpr std::string_view kMinus = "\xE2\x88\x92";  // U+2212
  std::string text;
  if (cell.starts_with(kMinus)) {
    text.append("-").append(cell.substr(kMinus.size()));
    cell = text;
  }
  if (decimal == '.') {
    if (const auto number = plain_number(cell)) return number;
    if (cell.find(',') == std::string_view::npos) return std::nullopt;
    std::string digits;
    return without_groups(cell, decimal, digits) ? plain_number(digits) : std::nullopt;
  }
  std::string digits;
  if (cell.find('.') != std::string_view::npos) {
    if (!without_groups(cell, decimal, digits)) return std::nullopt;
  } else {
    digits = cell;
  }
  const std::size_t comma = digits.find(',');
  if (comma == std::string::npos) return plain_number(digits);
  if (comma + 1 >= digits.size() || !is_digit(digits[comma + 1])) return std::nullopt;  // "1," is not a number
  digits[comma] = '.';
  return plain_number(digits);
}

bool may_be_grouped(std::string_view cell, char mark) {
  if (cell.starts_with('-') || cell.starts_with('+')) cell.remove_prefix(1);
  const std::size_t at = cell.find(mark);
  if (at == std::string_view::npos || at < 1 || at > 3 || cell.size() != at + 4 || cell[0] == '0') return false;
  return std::all_of(cell.begin(), cell.end(), [&](char c) { return is_digit(c) || c == mark; });
}

void GroupWatch::see(std::string_view cell) {
  if (shown_) return;
  if (cell.starts_with('-') || cell.starts_with('+')) cell.remove_prefix(1);
  const bool integer = !cell.empty() && cell.size() <= 3 && std::all_of(cell.begin(), cell.end(), is_digit);
  const bool group = may_be_grouped(cell, decimal_) && std::count(cell.begin(), cell.end(), decimal_) == 1;
  int number = 0;  // as a group
  if (integer || group)
    std::for_each(cell.begin(), cell.end(), [&](char c) { number = c == decimal_ ? number : 10 * number + (c - '0'); });
  if (integer) largest_integer_ = std::max(largest_integer_, number);
  if (group) least_group_ = std::min(least_group_, number);
  if (group && group_.empty()) group_ = cell;
  shown_ = !integer && !group && !is_hole(cell);
}

bool is_hole(std::string_view cell) {
  if (cell.empty()) return true;
  const char c = cell.front();
  if (is_digit(c) && cell.find('#') == std::string_view::npos) return false;
  constexpr std::array<std::string_view, 24> kHoles = {
      "nan",  "-nan", "+nan",     "nan(ind)",  "-nan(ind)", "na",     "n/a",   "#n/a",
      "-",    "--",   "#num!",    "#value!",   "#div/0!",   "#wert!", "#ref!", "inf",
      "+inf", "-inf", "infinity", "-infinity", "null",      "none",   "nil",   "?"};
  if (std::any_of(kHoles.begin(), kHoles.end(), [&](std::string_view hole) { return equal_ignoring_case(cell, hole); }))
    return true;
  // Microsoft's C library: 1.#QNAN, -1.#IND, 1.#INF
  return cell.find(".#") != std::string_view::npos && (cell.starts_with("1.#") || cell.starts_with("-1.#"));
}

}  // namespace prism::tables
