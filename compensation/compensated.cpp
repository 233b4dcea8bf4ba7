// SPDX-License-Identifier: MIT
#include "compensation/compensated.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace prism::compensation {
namespace {

constexpr std::pair<std::uint32_t, std::string_view> kNames[] = {
    {kWarming, "warming"},
    {kNoModel, "no_model"},
    {kInputMissing, "input_missing"},
    {kExtrapolating, "extrapolating"},
    {kFallback, "fallback"},
    {kOverLimit, "over_limit"},
    {kSettling, "settling"},
    {kRateInvalid, "rate_invalid"},
    {kNoData, "no_data"},
    {kImplausible, "implausible"},
    {kSlewLimited, "slew_limited"},
    {kClocksDiffer, "clocks_differ"},
};

constexpr std::size_t most_chars() {
  std::size_t chars = 0;
  for (const auto& [bit, name] : kNames) chars += name.size() + 1;
  return chars;
}
static_assert(most_chars() <= kQualityChars);

}  // namespace

char* put_quality(char* at, std::uint32_t quality) {
  if (quality == kGood) return std::copy_n("good", 4, at);
  char* end = at;
  for (const auto& [bit, name] : kNames) {
    if (!(quality & bit)) continue;
    if (end != at) *end++ = '+';
    for (const char c : name) *end++ = c;  // avoids a call for a few characters
  }
  return end;
}

std::string quality_text(std::uint32_t quality) {
  char text[kQualityChars];
  return std::string(text, put_quality(text, quality));
}

std::uint32_t parse_quality(std::string_view text) {
  std::uint32_t quality = kGood;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('+', begin), text.size());
    for (const auto& [bit, name] : kNames) {
      if (text.substr(begin, end - begin) == name) quality |= bit;
    }
    begin = end + 1;
  }
  return quality;
}

}  // namespace prism::compensation
