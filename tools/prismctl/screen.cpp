// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "tools/prismctl/views.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

constexpr double kStatusTimeoutS = 3;  ///< status is requested each second
constexpr int kNameColumns = 9, kScaleColumns = 10, kLeftColumns = kNameColumns + kScaleColumns + 2;

// The time spans of the traces.
constexpr std::array<double, 5> kSpansS = {60, 600, 3600, 21600, 86400};
constexpr std::array<const char*, 5> kSpans = {"1 min", "10 min", "1 h", "6 h", "24 h"},
                                     kHalfSpans = {"30 s", "5 min", "30 min", "3 h", "12 h"};

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char byte) { return (static_cast<unsigned char>(byte) & 0xC0) != 0x80; }));
}

// Printable, and truncated with "…" to `columns`.
std::string fitted(const std::string& text, std::size_t columns) {
  std::string shown = printable(text);
  if (columns_of(shown) <= columns) return shown;
  std::size_t end = std::min(shown.size(), columns);
  while (end < shown.size() && columns_of(shown.substr(0, end)) < columns) ++end;
  return std::string(utf8_prefix(shown, end - 1)) + "…";
}

// NaN if it is unknown.
double value_of(const json& row, const char* key) {
  return at(row, key).is_number() ? at(row, key).get<double>() : NAN;
}

// As many decimals as fit.
std::string scale_text(double value) {
  for (int decimals = 5; decimals >= 0; --decimals) {
    std::string text = fmt::format("{:.{}f}", value, decimals);
    if (text.size() <= kScaleColumns) return text;
  }
  return fmt::format("{:.2e}", value);
}

// Unicode braille: dots 1-3 and 7 in the left column, 4-6 and 8 in the right one.
std::string braille(unsigned dots) {
  const unsigned code = 0x2800 + dots;
  return {static_cast<char>(0xE0 | code >> 12), static_cast<char>(0x80 | (code >> 6 & 0x3F)),
          static_cast<char>(0x80 | (code & 0x3F))};
}

Colour colour_of(const std::string& quality) {
  if (quality == "good") return Colour::kGood;
  for (const char* reason : {"no_data", "rate_invalid", "input_missing", "over_limit", "implausible"}) {
    if (quality.find(reason) != std::string::npos) return Colour::kBad;
  }
  return Colour::kWarning;
}

// As `prismctl status`; the first line of an axis has the colour of its quality.
std::vector<Line> value_lines(const json& status) {
  std::vector<Line> lines;
  std::istringstream text(values_view(status));
  auto axis = at(status, "axes").begin();
  for (std::string line; std::getline(text, line);) {
    const bool is_first = line.starts_with("quality ") || line.starts_with("axis ");
    lines.push_back({line, is_first ? colour_of(text_of(at(*axis++, "quality"))) : Colour::kPlain});
  }
  return lines;
}

}  // namespace

void Trace::push(const json& row) {
  constexpr double kDayS = 86400;
  const double time_s = value_of(row, "time_s");
  if (!std::isfinite(time_s)) return;
  while (!points_.empty() && points_.back().time_s >= time_s) points_.pop_back();
  while (!points_.empty() && points_.front().time_s < time_s - kDayS) points_.pop_front();
  if (text_of(at(row, "quality")).find("warming") != std::string::npos) return;
  points_.push_back({time_s, value_of(row, "mean_rate_deg_per_h"), value_of(row, "corrected_mean_deg_per_h")});
}

std::vector<std::string> Trace::lines(const std::string& name, double end_s, double span_s, int columns,
                                      int rows) const {
  constexpr int kDotColumns = 2, kDotRows = 4;
  constexpr unsigned kBits[kDotColumns][kDotRows] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
  constexpr double kLeastSpan = 2e-5;   // resolution of the scale's digits
  constexpr double kLeastWidthS = 2.5;  // a row is a second: a shorter column shows the values around it
  const auto before = [](const Point& point, double time_s) { return point.time_s < time_s; };
  const auto first = std::lower_bound(points_.begin(), points_.end(), end_s - span_s, before);
  const bool corrected = std::any_of(first, points_.end(), [](const auto& p) { return std::isfinite(p.corrected); });
  double Point::*const value = corrected ? &Point::corrected : &Point::rate;
  double low = NAN, high = NAN;
  for (auto point = first; point != points_.end(); ++point)
    low = std::fmin(low, (*point).*value), high = std::fmax(high, (*point).*value);
  const double half = std::max(high - low, kLeastSpan) / 2, top = (low + high) / 2 + half;
  const std::size_t width = static_cast<std::size_t>(columns - kLeftColumns),
                    last_row = static_cast<std::size_t>(rows - 1);
  std::vector<unsigned> dots(width * (last_row + 1));
  const double step_s = span_s / static_cast<double>(width * kDotColumns),
               around_s = std::max(step_s, kLeastWidthS) / 2;
  for (std::size_t i = 0; i < width * kDotColumns; ++i) {
    const double middle_s = end_s - span_s + (static_cast<double>(i) + 0.5) * step_s;
    double sum = 0, count = 0;
    for (auto point = std::lower_bound(first, points_.end(), middle_s - around_s, before);
         point != points_.end() && point->time_s < middle_s + around_s; ++point) {
      if (std::isfinite((*point).*value)) sum += (*point).*value, ++count;
    }
    if (count == 0) continue;  // a gap
    const double last_dot = static_cast<double>(rows * kDotRows - 1);
    const auto dot =
        static_cast<std::size_t>(std::lround(std::clamp((top - sum / count) / (2 * half) * last_dot, 0.0, last_dot)));
    dots[dot / kDotRows * width + i / kDotColumns] |= kBits[i % kDotColumns][dot % kDotRows];
  }
  std::vector<std::string> lines;
  for (std::size_t row = 0; row <= last_row; ++row) {
    const char* const quantity = row < last_row ? "" : corrected ? "corrected" : "raw rate";
    const bool named = std::isfinite(low) && (row == 0 || row == last_row);
    lines.push_back(fmt::format("{:<{}}{:>{}} │", row == 0 ? utf8_prefix(name, kNameColumns) : quantity, kNameColumns,
                                named ? scale_text(row == 0 ? top : top - 2 * half) : "", kScaleColumns));
    for (std::size_t column = 0; column < width; ++column) lines.back() += braille(dots[row * width + column]);
  }
  return lines;
}

void Screen::status(json status, double steady_s) {
  status_ = std::move(status);
  status_steady_s_ = steady_s;
  instance_ = text_of(at(status_, "name"), instance_);
  gone_.clear();
  for (const auto& [axis, own] : at(status_, "axes").items()) {
    if (follows(TextRule::kAxisName, axis)) traces_[axis];
  }
}

void Screen::row(const json& row) {
  const auto trace = traces_.find(text_of(at(row, "axis")));
  if (trace == traces_.end() || !at(row, "time_s").is_number()) return;
  trace->second.push(row);
  row_time_s_ = at(row, "time_s").get<double>();
}

void Screen::event(const json& event) {
  constexpr std::size_t kKept = 16;
  const bool alarming = at(event, "severity") == "error" || at(event, "severity") == "warning";
  std::string text = event_line(event);
  text.pop_back();  // the line end
  events_.push_back({text, alarming ? Colour::kWarning : Colour::kPlain});
  if (events_.size() > kKept) events_.pop_front();
}

void Screen::key(char key) {
  if (key >= '1' && key <= '5') span_ = static_cast<std::size_t>(key - '1');
}

// The last status; without numbers of axes that have no current ones.
json Screen::current(double steady_s) const {
  json status = status_.is_object() ? status_ : json::object();
  const bool is_current = gone_.empty() && status_.is_object() && steady_s - status_steady_s_ <= kStatusTimeoutS;
  if (!is_current) {
    status["state"] = gone_.empty() ? "prismd does not respond" : "prismd stopped";
    status["detail"] = gone_.empty() ? "no response to status requests" : gone_ + "; retrying";
    if (at(status, "age_s").is_number()) status["age_s"] = number_member(status, "age_s") + steady_s - status_steady_s_;
  }
  for (json& axis : at(status, "axes").is_object() ? status["axes"] : status["axes"] = json::object()) {
    if (!is_current || at(axis, "quality") == "no_data") axis = {{"quality", "no_data"}, {"model", at(axis, "model")}};
  }
  return status;
}

// Of the same height for each axis; below them the time.
std::vector<Line> Screen::traces(int columns, int rows, double now_s) const {
  if (traces_.empty() || columns <= kLeftColumns) return {};
  const int each = std::max((rows - 1) / static_cast<int>(traces_.size()), 2), half = (columns - kLeftColumns) / 2;
  std::vector<Line> lines;
  for (const auto& [axis, trace] : traces_) {
    for (const std::string& line : trace.lines(axis, now_s, kSpansS[span_], columns, each))
      lines.push_back({line, Colour::kCurve});
  }
  const int window_s = window_length_s(at(at(status_, "axes"), traces_.begin()->first));
  lines.push_back({fmt::format("{:<{}}-{:<{}}-{:<{}}now", fmt::format("{} s mean, deg/h", window_s), kLeftColumns,
                               kSpans[span_], half, kHalfSpans[span_], std::max(columns - kLeftColumns - half - 5, 0)),
                   Colour::kFaint});
  return lines;
}

std::vector<Line> Screen::lines(const Size& size, double steady_s, const std::string& utc) const {
  constexpr int kTall = 36;
  const json status = current(steady_s);
  // State and age of the data; below them the reason, or the source.
  const std::string state = text_of(at(status, "state")), why = text_of(at(status, "detail"), "");
  std::string head = fmt::format("{}  {}, {}", instance_, state, age_text(at(status, "age_s")));
  const int gap = size.columns - static_cast<int>(columns_of(head) + columns_of(utc));
  if (gap > 0) head += std::string(static_cast<std::size_t>(gap), ' ') + utc;
  const bool good = state == "receiving" || state == "replaying";
  std::vector<Line> lines = {{head, good ? Colour::kGood : Colour::kBad}};
  const std::string source = text_of(at(status, "device"), "no device") + ", frames " + text_of(at(status, "frames"));
  lines.push_back(why.empty() ? Line{source} : Line{why, Colour::kBad});

  const auto add = [&lines](const auto& more) { lines.insert(lines.end(), more.begin(), more.end()); };
  const auto room = [&] { return size.rows - static_cast<int>(lines.size()) - 1; };
  add(value_lines(status));
  lines.push_back({frame_counts(status_)});
  // The time of the data may differ from this machine's clock: now is the last row's time and the age of the data.
  const double age_s = number_member(status_, "age_s") + steady_s - status_steady_s_;
  add(traces(size.columns, room() - (size.rows >= kTall ? 8 : 3), row_time_s_ + std::max(age_s, 0.0)));
  const auto events = std::min(static_cast<int>(events_.size()), std::max(room(), 0));
  add(std::vector<Line>(events_.end() - events, events_.end()));
  lines.resize(static_cast<std::size_t>(std::max(size.rows - 1, 0)));  // with few rows: the top and the keys
  lines.push_back({fmt::format("q quit   1-5 time span: {}", kSpans[span_]), Colour::kFaint});
  for (Line& line : lines) line.text = fitted(line.text, static_cast<std::size_t>(size.columns));
  return lines;
}

}  // namespace prism::prismctl
