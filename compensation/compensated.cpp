// SPDX-License-Identifier: MIT
#include "compensation/compensated.hpp"

#include <algorithm>
#include <utility>

namespace prism {
namespace {

constexpr std::pair<std::uint32_t, const char*> kNames[] = {
    {kWarming, "warming"},
    {kNoModel, "no_model"},
    {kInputMissing, "input_missing"},
    {kExtrapolating, "extrapolating"},
    {kFallback, "fallback"},
    {kOverLimit, "over_limit"},
    {kSettling, "settling"},
    {kRateInvalid, "rate_invalid"},
};

}  // namespace

std::string quality_text(std::uint32_t quality) {
  if (quality == kGood) return "good";
  std::string text;
  for (const auto& [bit, name] : kNames) {
    if (quality & bit) text += (text.empty() ? "" : "+") + std::string(name);
  }
  return text;
}

std::uint32_t parse_quality(const std::string& text) {
  std::uint32_t quality = kGood;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('+', begin), text.size());
    for (const auto& [bit, name] : kNames) {
      if (text.compare(begin, end - begin, name) == 0) quality |= bit;
    }
    begin = end + 1;
  }
  return quality;
}

}  // namespace prism
