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

int seconds_of(const json& value, int otherwise) {
  return static_cast<int>(std::clamp<std::int64_t>(integer_of(value, otherwise), 0, kMaxWindowS));
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

std::string count_text(const json& value) { return value.is_number() ? json_text(value) : "0"; }

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

std::string quality_words(const json& answer) {
  const std::string quality = text_of(at(answer, "quality"));
  if (quality == "no_data") return quality + " (no current measurement)";
  if (quality.find("warming") == std::string::npos) return quality;
  return fmt::format("{} ({} of {} s)", quality, seconds_of(at(answer, "warm_s"), 0),
                     seconds_of(at(answer, "full_s"), window_length_s(answer)));
}

int window_length_s(const json& answer) { return seconds_of(at(answer, "window_s"), kUsualWindowS); }

int mean_length_s(const json& answer) {
  const int window = window_length_s(answer), gathered = seconds_of(at(answer, "warm_s"), window);
  return gathered > 0 ? std::min(window, gathered) : window;
}

std::string bias_text(const json& row) {
  const bool with_sd = at(row, "bias_deg_per_h").is_number() && at(row, "sd_deg_per_h").is_number();
  if (!with_sd) return value_text(at(row, "bias_deg_per_h"), 5, " deg/h");
  return fmt::format("{} ± {}", value_text(at(row, "bias_deg_per_h"), 5),
                     value_text(at(row, "sd_deg_per_h"), 5, " deg/h"));
}

std::string event_text(const json& event) {
  std::string text = text_of(at(event, "text"));
  if (at(event, "repeats").is_number()) text += fmt::format(" ({} more times)", json_text(at(event, "repeats")));
  return text;
}

std::string labelled(const char* label, const std::string& value) { return fmt::format("{:<12} {}\n", label, value); }

std::string utc_of(const json& seconds) { return seconds.is_number() ? utc_text(integer_of(seconds)) : "-"; }

std::string short_id(const json& id, const std::string& otherwise) {
  return std::string(utf8_prefix(text_of(id, otherwise), 12));
}

std::string model_name(const json& model) {
  if (!model.is_object()) return "none";
  return fmt::format("{} ({}), id {}", text_of(at(model, "name"), "unnamed"), text_of(at(model, "kind")),
                     short_id(at(model, "id"), "-"));
}

int fail(const Error& error) {
  fmt::print(stderr, "prismctl: {}\n", error.text());
  return 1;
}

}  // namespace prism::prismctl
