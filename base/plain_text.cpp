// SPDX-License-Identifier: MIT
#include "base/plain_text.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace prism {
namespace {

constexpr std::size_t kLongestName = 64;  // longer names are not mistyped keys, and the table would be large
constexpr std::size_t kTellingLetters = 3;

/// Changes, insertions, deletions and swaps of neighbours from a to b (optimal string alignment), by rows.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::string plain_text(std::string_view text, std::size_t most) {
  std::string result;
  for (const char c : text.substr(0, most)) result += c >= 0x20 && c <= 0x7e ? c : '?';
  return text.size() > most ? result + "..." : result;
}

std::string nearest_name(std::string_view name, std::span<const std::string> names) {
  std::string nearest;
  std::size_t least = std::max<std::size_t>(1, name.size() / 3) + 1;
  if (name.size() < 2 || name.size() > kLongestName) return nearest;
  for (const std::string& candidate : names) {
    if (candidate.size() < 2 || candidate.size() > kLongestName) continue;
    const std::size_t common = std::min(name.size(), candidate.size());
    const bool begins = common >= kTellingLetters && name.substr(0, common) == candidate.substr(0, common);
    const std::size_t far = begins ? 1 : edits(name, candidate);
    if (far < least) least = far, nearest = candidate;
  }
  return nearest;
}

std::string counted(std::size_t count, std::string_view one) {
  return std::to_string(count) + " " + std::string(one) + (count == 1 ? "" : "s");
}

}  // namespace prism
