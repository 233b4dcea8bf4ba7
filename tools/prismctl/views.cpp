// SPDX-License-Identifier: MIT
#include "tools/prismctl/views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "tools/client/client.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

std::string short_id(const json& id, const std::string& otherwise) {
  return std::string(utf8_prefix(text_of(id, otherwise), 12));
}

// "warming (15 of 100 s)", "no_data (no current measurement)"; `answer` is one of status or bias.
std::string quality_words(const json& answer) {
  std::string quality = text_of(at(answer, "quality"));
  if (quality == "no_data") return quality + " (no current measurement)";
  if (quality.find("warming") == std::string::npos) return quality;
  return fmt::format("{} ({} of {} s)", quality, seconds_of(at(answer, "warm_s"), 0),
                     seconds_of(at(answer, "full_s"), window_length_s(answer)));
}

// Length of the long mean of a status or bias: the window, or its collected part.
int mean_length_s(const json& answer) {
  const int window = window_length_s(answer), gathered = seconds_of(at(answer, "warm_s"), window);
  return gathered > 0 ? std::min(window, gathered) : window;
}

// "8.47111 ± 0.00700 deg/h"
std::string bias_text(const json& row) {
  const bool with_sd = at(row, "bias_deg_per_h").is_number() && at(row, "sd_deg_per_h").is_number();
  if (!with_sd) return value_text(at(row, "bias_deg_per_h"), 5, " deg/h");
  return fmt::format("{} ± {}", value_text(at(row, "bias_deg_per_h"), 5),
                     value_text(at(row, "sd_deg_per_h"), 5, " deg/h"));
}

// "composite T,dTdt,U (composite), id d5ddc53c95af"
std::string model_name(const json& model) {
  if (!model.is_object()) return short_id(model, "none");  // of bias: the id
  return fmt::format("{} ({}), id {}", text_of(at(model, "name"), "unnamed"), text_of(at(model, "kind")),
                     short_id(at(model, "id"), "-"));
}

// Means of a second and of the window, never a single frame, which has 0 or 1 pulse on some gyros.
std::string means_text(const json& second, const json& window, int window_s) {
  if (!second.is_number() && !window.is_number()) return "-";
  return fmt::format("{} over 1 s, {} over {} s", value_text(second, 5, " deg/h"), value_text(window, 5, " deg/h"),
                     window_s);
}

// A mean of the window; of a sample and of the result of bias, which lack it, the value itself.
const json& mean_of(const json& w, const char* mean, const char* value) {
  return w.is_object() && w.contains(mean) ? at(w, mean) : at(w, value);
}

std::string columns_text(const json& w) {
  return fmt::format("{:>12} {:>11} {:>12} {:>10} {:>11} {:>8}",
                     value_text(mean_of(w, "mean_rate_deg_per_h", "rate_deg_per_h"), 5),
                     value_text(at(w, "bias_deg_per_h"), 5),
                     value_text(mean_of(w, "corrected_mean_deg_per_h", "corrected_deg_per_h"), 5),
                     value_text(mean_of(w, "mean_temperature_degc", "temperature_degc"), 3),
                     value_text(at(w, "slope_degc_per_s"), 6), value_text(mean_of(w, "mean_uhfo_v", "uhfo_v"), 4));
}

std::string columns_heading() {
  return fmt::format("{:>12} {:>11} {:>12} {:>10} {:>11} {:>8}", "rate deg/h", "bias", "corrected", "T degC", "dT/dt",
                     "U V");
}

// Of at most 80 columns: the means of the window of each axis below its quality and model.
std::string axes_table(const json& axes) {
  constexpr std::size_t kColumns = 80;
  std::string text = fmt::format("{} {:>9}\n", columns_heading(), "sd");
  for (const auto& [name, axis] : axes.items()) {
    const json& w = at(axis, "window");
    const json& model = at(axis, "model");
    const std::string model_text =
        "model " + (model.is_object() ? text_of(at(model, "name"), "unnamed") : short_id(model, "none"));
    const std::string label = "axis " + printable(name),
                      line = labelled(label.c_str(), quality_words(axis) + "; " + model_text);
    text +=
        line.size() <= kColumns ? line : labelled(label.c_str(), quality_words(axis) + ";") + labelled("", model_text);
    text += fmt::format("{} {:>9}\n", columns_text(w), value_text(at(w, "sd_deg_per_h"), 5));
  }
  return text;
}

// "0.0031 ± 0.0140 deg/h from the Earth rate, over 1800 s"; empty for a prismd before 0.4 or without a site.
std::string rest_line(const json& rest) {
  const std::string unknown = text_of(at(rest, "unknown"), "");
  if (!rest.is_object() || unknown == "no_site") return {};
  if (!unknown.empty()) return labelled("at rest", "not compared with the Earth rate: {}", unknown);
  return labelled("at rest", "{} ± {} from the Earth rate, over {} s", value_text(at(rest, "difference_deg_per_h"), 4),
                  value_text(at(rest, "sd_deg_per_h"), 4, " deg/h"), seconds_of(at(rest, "seen_s"), 0));
}

// "holds: 31 days, … (2026-11-29T03:12:00Z)"; empty without a verdict.
std::string monitor_line(const json& monitor) {
  if (!monitor.is_object()) return {};
  return labelled("monitor", "{} ({})", text_of(at(monitor, "text")), utc_of(at(monitor, "at_s")));
}

// "0.00200 deg/h by command until 2026-11-29T20:00:00Z: REASON"; empty without an offset.
std::string offset_line(const json& offset) {
  if (!offset.is_object()) return {};
  const json& expires_s = at(offset, "expires_s");
  return labelled("offset", "{} by command{}: {}", value_text(at(offset, "deg_per_h"), 5, " deg/h"),
                  integer_of(expires_s) > 0 ? " until " + utc_of(expires_s) : "", text_of(at(offset, "reason")));
}

// Current values of one axis: `s` has its quality, window and model.
std::string measured(const json& s) {
  std::string text = labelled("quality", "{}, {}", quality_words(s), age_text(at(s, "age_s")));
  const json& w = at(s, "window");
  const int window_s = mean_length_s(s);
  text += labelled("rate", means_text(at(w, "rate_deg_per_h"), at(w, "mean_rate_deg_per_h"), window_s));
  text += labelled("bias", bias_text(w));
  text += labelled("corrected", means_text(at(w, "corrected_deg_per_h"), at(w, "corrected_mean_deg_per_h"), window_s));
  text += offset_line(at(s, "offset"));
  text += rest_line(at(s, "at_rest"));
  text += monitor_line(at(s, "monitor"));
  text += labelled("temperature", "{}, slope {}",
                   value_text(mean_of(w, "mean_temperature_degc", "temperature_degc"), 3, " degC"),
                   value_text(at(w, "slope_degc_per_s"), 6, " degC/s"));
  text += labelled("UHFO", value_text(mean_of(w, "mean_uhfo_v", "uhfo_v"), 4, " V"));
  return text + labelled("model", model_name(at(s, "model")));
}

// Names and values in lines of at most 80 columns.
std::string values_text(const char* label, const json& values) {
  constexpr std::size_t kWidth = 80 - 13;
  std::string text, row;
  for (const auto& [name, value] : values.items()) {
    const std::string unit = text_of(at(value, "unit"));
    const std::string one =
        printable(name) + " " + value_text(at(value, "value"), unit.ends_with("/s") ? 6 : 3, (" " + unit).c_str());
    if (!row.empty() && row.size() + 2 + one.size() > kWidth) {
      text += labelled(text.empty() ? label : "", row + ",");
      row.clear();
    }
    row += (row.empty() ? "" : ", ") + one;
  }
  return row.empty() ? text : text + labelled(text.empty() ? label : "", row);
}

// "gyro-….csv (86400 rows) in 3 d 4 h, 2026-11-23T09:11:00Z: more than 10240.0 MiB"; empty if no deletion is expected.
std::string deletion_line(const json& retention) {
  constexpr double kMiB = 1 << 20, kDay = 86400;
  const json& next = at(retention, "next");
  if (!next.is_object()) return {};
  std::string text = text_of(at(next, "file"), "-");
  if (integer_of(at(next, "rows")) > 0) text += fmt::format(" ({} rows)", count_text(at(next, "rows")));
  if (at(next, "in_s").is_number())
    text += fmt::format(" in {}, {}", span_text(at(next, "in_s").get<double>()), utc_of(at(next, "time_s")));
  const auto limit = [&](const char* key, double unit) {
    return at(retention, key).is_number() ? at(retention, key).get<double>() / unit : 0;
  };
  text += at(next, "why") == "age" ? fmt::format(": older than {:.0f} days", limit("keep_s", kDay))
                                   : fmt::format(": more than {:.1f} MiB", limit("keep_bytes", kMiB));
  return labelled("deletes next", text);
}

// Of the log of each axis and of the capture.
std::string deletions_text(const json& status) {
  std::string text = deletion_line(at(at(status, "log"), "retention"));
  for (const json& axis : at(status, "axes")) text += deletion_line(at(at(axis, "log"), "retention"));
  return text + deletion_line(at(at(status, "capture"), "retention"));
}

// "connecting: why"
std::string state_text(const json& line) {
  const std::string why = text_of(at(line, "detail"), "");
  return text_of(at(line, "state")) + (why.empty() ? "" : ": " + why);
}

// "receiving, last value 0.4 s old"
std::string line_state(const json& l) {
  const std::string state = state_text(l);
  return at(l, "age_s").is_number() ? fmt::format("{}, last value {:.1f} s old", state, at(l, "age_s").get<double>())
                                    : state + ", no value yet";
}

// "health   failed: log: cannot write (…)", one line per problem, which is a text for a prismd before 0.4; empty before
// 0.3.
std::string health_lines(const json& health) {
  if (!health.is_object()) return {};
  const json& problems = at(health, "problems");
  std::string text;
  for (const json& problem : problems.is_array() ? problems : json::array())
    text += labelled(text.empty() ? "health" : "", (text.empty() ? text_of(at(health, "state")) + ": " : "") +
                                                       text_of(problem.is_string() ? problem : at(problem, "text")));
  return text.empty() ? labelled("health", text_of(at(health, "state"))) : text;
}

// Of an output: median and 99th percentile.
std::string latency_text(const json& output) {
  const json &median = at(output, "latency_p50_s"), &most = at(output, "latency_p99_s");
  if (!median.is_number() || !most.is_number()) return "unknown";
  return fmt::format("{:.2f} ms, p99 {:.2f} ms", 1e3 * median.get<double>(), 1e3 * most.get<double>());
}

constexpr std::int64_t kFewBlocks = 20;
/// A raw standard deviation below this multiple of the noise leaves little to correct.
constexpr double kNearNoise = 1.25;

std::optional<double> number(const json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

std::string joined(const std::vector<std::string>& parts) { return fmt::format("{}", fmt::join(parts, ", ")); }

// Null if `list` has no such element.
const json& element(const json& list, std::size_t i) {
  static const json kNone;
  return list.is_array() && i < list.size() ? list[i] : kNone;
}

// "T -40 to 70 degC": an input with the range of its training values.
std::string ranges_text(const json& model) {
  const json& inputs = at(model, "inputs");
  std::vector<std::string> parts;
  for (std::size_t i = 0; inputs.is_array() && i < inputs.size(); ++i) {
    const auto min = number(element(at(at(model, "domain"), "min"), i)),
               max = number(element(at(at(model, "domain"), "max"), i));
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
  const json &begin = element(element(points, 0), 0), &end = element(element(points, points.size() - 1), 0);
  if (begin.is_number()) text += fmt::format(", {} to {}", utc_of(begin), utc_of(end));
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

json with_only_axis(json result) {
  const json& axes = at(result, "axes");
  if (!axes.is_object() || axes.size() != 1) return result;
  if (result.size() == 1) return json(axes.front());
  const std::string name = axes.begin().key();
  return client::with_axis(std::move(result), name);
}

Result<void> choose_axis(json& result, const std::string& axis) {
  if (axis.empty() || !at(result, "axes").is_object()) return {};
  json& axes = result["axes"];
  std::vector<std::string> names;
  for (const auto& [name, own] : axes.items()) names.push_back(name);
  if (!axes.contains(axis))
    return make_error("--axis", fmt::format("found {}, expected one of {}", axis, fmt::join(names, ", ")));
  axes = {{axis, json(axes[axis])}};
  return {};
}

std::string each_axis(const json& result, const std::function<std::string(const json&)>& view) {
  const json& axes = at(result, "axes");
  if (!axes.is_object()) return view(result);
  std::string text;
  for (const auto& [name, own] : axes.items()) {
    if (axes.size() > 1) text += (text.empty() ? "" : "\n") + fmt::format("axis {}\n", printable(name));
    text += view(own);
  }
  return text;
}

std::string values_view(const json& status) {
  const json s = with_only_axis(status);
  const json& axes = at(s, "axes");
  return axes.is_object() ? axes_table(axes) : measured(s);
}

std::string frame_counts(const json& status) {
  json counts = at(status, "line");
  if (counts.is_object()) counts["missing"] = at(at(status, "timing"), "missing_frames");
  return counts_text("{} frames good, {} failed their check, {} missing, {} resyncs, {} bytes skipped", counts,
                     "frames", "bad_check", "missing", "resyncs", "skipped_bytes");
}

std::string status_view(const json& status) {
  const json s = with_only_axis(status);
  std::string text = labelled("instance", "{} (prismd {})", text_of(at(s, "name")), text_of(at(s, "version")));
  text += health_lines(at(s, "health"));
  text += labelled("state", "{}, since {}", state_text(s), utc_of(at(s, "state_since_s")));
  if (const std::string problem = text_of(at(s, "no_rate"), ""); !problem.empty()) text += labelled("no rate", problem);
  if (const std::string problem = text_of(at(s, "clocks_differ"), ""); !problem.empty())
    text += labelled("clock", problem);
  if (at(s, "axes").is_object()) text += labelled("data", age_text(at(s, "age_s")));
  text += values_view(status);
  text += labelled("gyro", text_of(at(s, "gyro_serial"), "serial number not configured"));
  text += labelled("device", "{}, frames {}, clock {}", text_of(at(s, "device"), "none"), text_of(at(s, "frames")),
                   text_of(at(s, "clock")));
  text += labelled("line", frame_counts(s));
  for (const auto& [name, own] : at(s, "sensor_lines").items()) {
    text += labelled(printable(name).c_str(), line_state(own));
    text += labelled("", "{}, frames {}", text_of(at(own, "device")), text_of(at(own, "frames")));
  }
  for (std::size_t i = 0; i < at(s, "out").size(); ++i) {
    const json& own = at(s, "out")[i];
    text += labelled(i == 0 ? "outputs" : "", text_of(at(own, "device")) + ": " + state_text(own));
    text += labelled("", counts_text("{} frames: {} corrected, {} fading, {} held, {} raw; {} dropped; latency ", own,
                                     "frames", "corrected", "fading", "held", "raw", "dropped") +
                             latency_text(own));
  }
  text += values_text("sensors", at(s, "sensors"));
  if (const json& log = at(s, "log"); log.is_object())
    text +=
        labelled("log", text_of(at(log, "directory")) + counts_text(": {} rows, {} dropped", log, "rows", "dropped"));
  return text + deletions_text(s) +
         labelled("clients", counts_text("{} connected, {} rows lost by slow clients", at(s, "clients"), "connected",
                                         "lost_rows"));
}

std::string bias_view(const json& result) {
  json status = {{"axes", at(result, "axes")}};
  for (json& axis : status["axes"]) {
    if (!axis.is_object()) continue;
    json window = axis;
    window["rate_deg_per_h"] = at(axis, "second_rate_deg_per_h");
    window["corrected_deg_per_h"] = at(axis, "second_corrected_deg_per_h");
    axis["window"] = window;
  }
  const json& axes = status["axes"];
  const json first = axes.is_object() && !axes.empty() ? axes.front() : json();
  const std::string age = axes.size() > 1 ? ", " + age_text(at(first, "age_s")) : "";
  std::string text = labelled("time", utc_of(at(first, "time_s")) + age);
  text += values_view(status);
  if (axes.size() > 1) return text;
  json others = at(first, "inputs");  // of the model, besides those shown
  for (const char* shown : {"T", "dTdt", "U"}) {
    if (others.is_object()) others.erase(shown);
  }
  return text + values_text("inputs", others);
}

// Missing frames that were counted by arrival times, not by the gyro's counter.
std::string by_arrival(const json& timing) {
  const json& count = at(timing, "missing_by_arrival");
  return count.is_number() && count > 0 ? fmt::format(" ({} of them by arrival times)", json_text(count)) : "";
}

std::string decoder_text(const json& d) {
  return labelled("frames",
                  counts_text("{} good of {} bytes; rejected: {} by checksum, {} by length, {} by body; {} refused", d,
                              "frames", "bytes", "bad_check", "bad_length", "bad_body", "refused")) +
         labelled("", counts_text("{} bytes skipped, {} resyncs, {} time-outs, {} values out of range", d,
                                  "skipped_bytes", "resyncs", "timeouts", "out_of_range"));
}

std::string hardware_text(const json& h) {
  if (!h.is_object()) return "this device does not count errors";
  return counts_text("{} parity, {} framing, {} overrun, {} buffer overrun errors, {} breaks", h, "parity_errors",
                     "framing_errors", "overruns", "buffer_overruns", "breaks");
}

std::string line_text(const json& l, const std::string& state) {
  std::string text = labelled("device", "{} at {} baud", text_of(at(l, "device"), "none"), count_text(at(l, "baud")));
  text += labelled("state", state);
  for (const json& note : at(l, "notes")) text += labelled("note", text_of(note));
  return text + decoder_text(at(l, "decoder"));
}

std::string line_view(const json& l) {
  std::string text = line_text(l, state_text(l));
  const json& t = at(l, "timing");
  text += labelled("counter", "{} frames missing{}, {} duplicates, {} resets", count_text(at(t, "missing_frames")),
                   by_arrival(t), count_text(at(t, "duplicates")), count_text(at(t, "resets")));
  const bool estimated = at(t, "period_is_estimated") == true;
  text += labelled("period", "{:.6f} ms ({}), nominal {:.6f} ms", 1e3 * number_member(t, "period_s"),
                   estimated ? "estimated" : "nominal", 1e3 * number_member(l, "nominal_period_s"));
  text += labelled("hardware", hardware_text(at(l, "hardware")));
  for (const auto& [name, own] : at(l, "sensor_lines").items())
    text += '\n' + labelled("line", printable(name)) + line_text(own, line_state(own)) +
            labelled("hardware", hardware_text(at(own, "hardware")));
  return text;
}

std::string event_line(const json& e) {
  const json& repeats = at(e, "repeats");
  return fmt::format("{}  {:<7} {}{}\n", utc_of(at(e, "time_s")), text_of(at(e, "severity")), text_of(at(e, "text")),
                     repeats.is_number() ? fmt::format(" ({} more times)", json_text(repeats)) : "");
}

std::string window_heading() { return fmt::format("{:<20} {}  {}\n", "time (UTC)", columns_heading(), "quality"); }

std::string window_line(const json& w) {
  return fmt::format("{:<20} {}  {}\n", utc_of(at(w, "time_s")), columns_text(w), text_of(at(w, "quality")));
}

std::string model_view(const json& m) {
  if (!m.is_object()) return "no model is loaded: rates are not corrected\n";
  const json& provenance = at(m, "provenance");
  const json& window = at(m, "window");
  std::string text = labelled("model", "{} ({})", text_of(at(m, "name"), "unnamed"), text_of(at(m, "kind")));
  text += labelled("id", text_of(at(m, "id"))) + labelled("file", text_of(at(m, "file"))) +
          labelled("in use since", utc_of(at(m, "loaded_s"))) + labelled("gyro", text_of(at(m, "gyro_serial"), "any"));
  text += labelled("made", "{} by {}", text_of(at(provenance, "made")), text_of(at(provenance, "tool")));
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
  if (more > 0) text += labelled("uncorrected", "{} means more", more);
  return text + labelled("model", model_name(at(s, "model")));
}

}  // namespace prism::prismctl
