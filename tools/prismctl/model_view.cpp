// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/prismctl/views.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

constexpr std::int64_t kFewBlocks = 20;
/// A raw standard deviation below this multiple of the noise leaves little to correct.
constexpr double kNearNoise = 1.25;

std::optional<double> number(const json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

std::string joined(const std::vector<std::string>& parts) { return fmt::format("{}", fmt::join(parts, ", ")); }

// "T -40 to 70 degC": an input with the range of its training values.
std::string ranges_text(const json& model) {
  const json& inputs = at(model, "inputs");
  const auto limit = [&](const char* key, std::size_t i) {
    const json& limits = at(at(model, "domain"), key);
    return limits.is_array() && i < limits.size() ? number(limits[i]) : std::nullopt;
  };
  std::vector<std::string> parts;
  for (std::size_t i = 0; inputs.is_array() && i < inputs.size(); ++i) {
    const auto min = limit("min", i), max = limit("max", i);
    const std::string name = text_of(inputs[i]);
    const char* const unit = name == "T" ? " degC" : name == "dTdt" ? " degC/s" : name == "U" ? " V" : "";
    parts.push_back(name + (min && max ? fmt::format(" {:.4g} to {:.4g}{}", *min, *max, unit) : ""));
  }
  return joined(parts);
}

// "143 means of 100 s (4.0 h), 2026-01-01T00:00:01Z to 2026-01-01T03:59:51Z, 2 gaps"
std::string recording_text(const json& recording, double block_s) {
  const double blocks = static_cast<double>(integer_of(at(recording, "blocks")));
  std::string text = fmt::format("{}: {:.0f} means of {:g} s ({:.1f} h)", text_of(at(recording, "name")), blocks,
                                 block_s, blocks * block_s / 3600);
  const json& points = at(recording, "fingerprint");
  if (points.is_array() && !points.empty() && points.front().is_array() && points.back().is_array() &&
      !points.front().empty() && !points.back().empty() && points.front()[0].is_number())
    text += fmt::format(", {} to {}", utc_of(points.front()[0]), utc_of(points.back()[0]));
  if (const std::int64_t gaps = integer_of(at(recording, "gaps")); gaps > 0) text += fmt::format(", {} gaps", gaps);
  return text;
}

// "warn: length 143 blocks, expected at least 200"
std::string quality_text(const json& quality) {
  if (!quality.is_object()) return "not judged";
  std::vector<std::string> problems;
  const json& findings = at(quality, "findings");
  for (const json& finding : findings.is_array() ? findings : json::array()) {
    if (at(finding, "verdict") == "pass") continue;
    const auto low = number(at(finding, "warn_below")), high = number(at(finding, "warn_above"));
    std::string text = text_of(at(finding, "name"));
    if (const auto value = number(at(finding, "value"))) text += fmt::format(" {:.3g}", *value);
    if (const std::string unit = text_of(at(finding, "unit"), ""); !unit.empty()) text += " " + unit;
    if (low) text += fmt::format(", expected at least {:g}", *low);
    if (high) text += fmt::format(", expected at most {:g}", *high);
    problems.push_back(text);
  }
  const std::string verdict = text_of(at(quality, "verdict"));
  return problems.empty() ? verdict : fmt::format("{}: {}", verdict, fmt::join(problems, "; "));
}

// Improvement and errors to expect on another day.
std::string expected_text(const json& training) {
  const json& expected = at(training, "expected");
  const auto gain = number(at(expected, "improvement_percent")), low = number(at(expected, "low_percent")),
             high = number(at(expected, "high_percent"));
  const json& spread = at(training, "spread");
  const auto drift = number(at(spread, "nuisance_deg_per_h")), offset = number(at(spread, "offset_deg_per_h")),
             noise = number(at(spread, "noise_deg_per_h"));
  const double factor = number(at(spread, "factor")).value_or(1);
  std::vector<std::string> parts;
  if (gain && low && high)
    parts.push_back(fmt::format("improvement {:.0f} % ({:.0f} to {:.0f} %)", *gain, *low, *high));
  if (const auto skill = number(at(training, "skill")))
    parts.push_back(fmt::format("each half of the recording explains {:.0f} % of the other's variation", 100 * *skill));
  if (drift && noise)
    parts.push_back(
        fmt::format("errors on another day (1 sigma): unexplained drift {:.2g}, constant offset {:.2g}, noise of a "
                    "mean {:.2g} deg/h",
                    factor * *drift, factor * offset.value_or(0), factor * *noise));
  return parts.empty() ? "see the report of prismcal evaluate" : joined(parts);
}

std::string recordings_text(const json& provenance, double block_s) {
  const json& recordings = at(provenance, "recordings");
  std::string text;
  for (const json& recording : recordings.is_array() ? recordings : json::array()) {
    text += labelled(text.empty() ? "trained on" : "", recording_text(recording, block_s));
    text += labelled("", "data quality " + quality_text(at(recording, "data_quality")));
  }
  return text.empty() ? labelled("trained on", text_of(at(provenance, "source"), "unknown")) : text;
}

// "0.00690 deg/h (0.00650 to 0.00735)": an estimate from n values is uncertain by 1/sqrt(2 (n - 1)).
std::string sd_text(const json& series) {
  const auto sd = number(at(series, "sd_deg_per_h"));
  const std::int64_t blocks = integer_of(at(series, "blocks"));
  if (!sd || blocks < 2) return "-";
  const double unsure = *sd / std::sqrt(2.0 * static_cast<double>(blocks - 1));
  return fmt::format("{:.5f} deg/h ({:.5f} to {:.5f}) over {} means", *sd, std::max(0.0, *sd - unsure), *sd + unsure,
                     blocks);
}

std::string conclusion(const json& s) {
  const auto raw = number(at(at(s, "raw"), "sd_deg_per_h")), noise = number(at(s, "noise_deg_per_h"));
  const auto gain = number(at(s, "improvement"));
  if (!raw || !gain) return "two corrected means are needed";
  if (noise && *raw < kNearNoise * *noise)
    return fmt::format("nothing to correct yet: the raw rate varies little more than the noise, {:.5f} deg/h", *noise);
  if (integer_of(at(at(s, "raw"), "blocks")) < kFewBlocks) return "too early to judge: fewer than 20 means";
  return *gain > 0 ? "the correction helps" : "the correction does not help: compare the inputs with the model's range";
}

}  // namespace

std::string model_view(const json& m) {
  if (!m.is_object()) return "no model is loaded: rates are not corrected\n";
  const json& provenance = at(m, "provenance");
  const json& window = at(m, "window");
  std::string text =
      labelled("model", fmt::format("{} ({})", text_of(at(m, "name"), "unnamed"), text_of(at(m, "kind"))));
  text += labelled("id", text_of(at(m, "id"))) + labelled("file", text_of(at(m, "file"))) +
          labelled("in use since", utc_of(at(m, "loaded_s"))) + labelled("gyro", text_of(at(m, "gyro_serial"), "any"));
  text += labelled("made", fmt::format("{} by {}", text_of(at(provenance, "made")), text_of(at(provenance, "tool"))));
  text += recordings_text(provenance, number(at(window, "length_s")).value_or(0));
  text += labelled("range", ranges_text(m));
  text += labelled("expect", expected_text(at(provenance, "training")));
  if (const std::string note = text_of(at(provenance, "note"), ""); !note.empty()) text += labelled("note", note);
  return text;
}

std::string stability_view(const json& s) {
  std::string text = fmt::format("Bias stability: 1 sigma of {} s means, divisor {}\n", count_text(at(s, "block_s")),
                                 text_of(at(s, "divisor")));
  text += labelled("raw", sd_text(at(s, "raw"))) + labelled("corrected", sd_text(at(s, "corrected")));
  const auto gain = number(at(s, "improvement"));
  text += labelled("improvement", (gain ? fmt::format("{:.1f} %: ", 100 * *gain) : "- : ") + conclusion(s));
  const std::int64_t more = integer_of(at(at(s, "all"), "blocks")) - integer_of(at(at(s, "raw"), "blocks"));
  if (more > 0) text += labelled("uncorrected", fmt::format("{} means more", more));
  return text + labelled("model", model_name(at(s, "model")));
}

}  // namespace prism::prismctl
