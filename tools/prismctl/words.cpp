// SPDX-License-Identifier: MIT
#include "tools/prismctl/words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/text_number.hpp"

namespace prism::prismctl {

using nlohmann::json;

namespace {

constexpr int kUsualWindowS = 100, kMaxWindowS = 1 << 20;

std::int64_t bounded(double value) {
  constexpr double kMax = 9e15;  // a double represents every integer up to it
  return std::isnan(value) ? 0 : static_cast<std::int64_t>(std::clamp(value, -kMax, kMax));
}

}  // namespace

std::string text_of(const json& value, const std::string& otherwise) {
  const std::string text = value.is_string() ? printable(value.get_ref<const std::string&>()) : "";
  return text.empty() ? otherwise : text;
}

std::int64_t integer_of(const json& value, std::int64_t otherwise) {
  return value.is_number() ? bounded(value.get<double>()) : otherwise;
}

std::string value_text(const json& value, int decimals, const char* unit) {
  if (!value.is_number()) return "-";
  return fmt::format("{:.{}f}{}", value.get<double>(), decimals, unit);
}

std::string count_text(const json& value) { return value.is_number() ? json_text(value) : "-"; }

std::string span_text(double seconds) {
  constexpr std::int64_t kMinute = 60, kHour = 60 * kMinute, kDay = 24 * kHour;
  if (seconds < 10) return fmt::format("{:.1f} s", std::max(seconds, 0.0));
  const std::int64_t whole = bounded(seconds);
  const auto two = [&](std::int64_t unit, const char* name, std::int64_t below, const char* name_below) {
    return fmt::format("{} {} {} {}", whole / unit, name, whole % unit / below, name_below);
  };
  if (whole < kMinute) return fmt::format("{} s", whole);
  if (whole < kHour) return two(kMinute, "min", 1, "s");
  if (whole < kDay) return two(kHour, "h", kMinute, "min");
  return two(kDay, "d", kHour, "h");
}

std::string age_text(const json& age_s) {
  return age_s.is_number() ? fmt::format("last data {} ago", span_text(age_s.get<double>())) : "no data yet";
}

int seconds_of(const json& value, int otherwise) {
  return static_cast<int>(std::clamp<std::int64_t>(integer_of(value, otherwise), 0, kMaxWindowS));
}

int window_length_s(const json& answer) { return seconds_of(at(answer, "window_s"), kUsualWindowS); }

std::string utc_of(const json& seconds) { return seconds.is_number() ? utc_text(integer_of(seconds)) : "-"; }

int fail(const Error& error) {
  fmt::print(stderr, "prismctl: {}\n", error.text());
  return 1;
}

}  // namespace prism::prismctl
