// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen/view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "base/outside_text.hpp"
#include "base/text_number.hpp"
#include "tools/prismctl/axes_view.hpp"
#include "tools/prismctl/screen/chart.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::screen {
namespace {

using nlohmann::json;
using prismctl::at, prismctl::count_text, prismctl::text_of, prismctl::value_text;

constexpr double kStatusTimeoutS = 3;  ///< status is requested each second
constexpr double kStatusFreshS = 1.5;  ///< until then its ages are current
constexpr std::size_t kEventsKept = 16;

struct Span {
  double seconds;
  const char* name;
};
constexpr std::array<Span, 9> kSpans = {{{60, "1 min"},
                                         {120, "2 min"},
                                         {300, "5 min"},
                                         {600, "10 min"},
                                         {1200, "20 min"},
                                         {1800, "30 min"},
                                         {3600, "1 h"},
                                         {21600, "6 h"},
                                         {86400, "24 h"}}};

Meaning meaning_of_quality(const std::string& quality) {
  if (quality == "good") return Meaning::kGood;
  const auto has = [&](const char* reason) { return quality.find(reason) != std::string::npos; };
  const bool bad =
      has("no_data") || has("rate_invalid") || has("input_missing") || has("over_limit") || has("implausible");
  return bad ? Meaning::kBad : Meaning::kWarning;
}

Meaning meaning_of_state(const std::string& state) {
  return state == "receiving" || state == "replaying" ? Meaning::kGood : Meaning::kBad;
}

Line event_line(const json& event) {
  constexpr std::size_t kMonth = 5, kMomentChars = 14;
  const std::string severity = text_of(at(event, "severity"));
  const Meaning meaning = severity == "error"     ? Meaning::kBad
                          : severity == "warning" ? Meaning::kWarning
                                                  : Meaning::kPlain;
  std::string moment = utc_text(prismctl::integer_of(at(event, "time_s")));  // 2026-11-21T09:11:00Z: month to second
  if (moment.size() > kMonth + kMomentChars) moment = moment.substr(kMonth, kMomentChars);
  std::replace(moment.begin(), moment.end(), 'T', ' ');
  return {{moment + " ", Meaning::kFaint}, {prismctl::event_text(event), meaning}};
}

}  // namespace

void View::status(const json& status, double steady_s) {
  status_ = prismctl::with_only_axis(status);
  status_steady_s_ = steady_s;
  instance_ = text_of(at(status, "name"), instance_);
  gone_.clear();
  axes_.clear();
  if (const json& axes = at(status_, "axes"); axes.is_object()) {
    for (const auto& [name, axis] : axes.items()) {
      if (follows(TextRule::kAxisName, name)) axes_.push_back(name);
    }
  }
  if (chosen_ >= axes_.size()) chosen_ = 0;
  const auto preferred = std::find(axes_.begin(), axes_.end(), preferred_);
  if (preferred != axes_.end()) chosen_ = static_cast<std::size_t>(preferred - axes_.begin());
}

// The part of a response that belongs to one axis; all of it for a device with one axis.
const json& View::axis_status(const std::string& axis) const {
  return axes_.empty() ? status_ : at(at(status_, "axes"), axis);
}

const std::string& View::charted() const {
  static const std::string kOnly;
  return axes_.empty() ? kOnly : axes_[chosen_];
}

void View::history(const json& result, double steady_s) {
  for (const json& rows : at(result, "axes")) {
    for (const json& row : rows) window(row, steady_s);
  }
  if (at(status_, "age_s").is_number()) row_steady_s_ -= at(status_, "age_s").get<double>();
}

void View::window(const json& row, double steady_s) {
  const std::string axis = axes_.empty() ? "" : text_of(at(row, "axis"));
  traces_[axis].push(row, prismctl::window_length_s(axis_status(axis)));
  row_steady_s_ = steady_s;
  if (axes_.empty()) {
    if (status_.is_object()) status_["window"] = row;
  } else if (at(at(status_, "axes"), axis).is_object()) {
    status_["axes"][axis]["window"] = row;
  }
}

void View::events(const json& events) {
  events_.clear();
  for (const json& event : events) this->event(event);
}

void View::event(const json& event) {
  events_.push_back(event);
  if (events_.size() > kEventsKept) events_.pop_front();
}

void View::key(char key, double steady_s) {
  if (key >= '1' && key <= '9') span_ = static_cast<std::size_t>(key - '1');
  if (key == 'a') same_scale_ = !same_scale_;
  if (key == '?') help_ = !help_;
  choose(key);
  if (key != 'p') return;
  paused_at_s_ = paused_at_s_ ? std::nullopt : std::optional(data_now_s(steady_s));
}

void View::choose(char key) {
  if (key == '\t' && !axes_.empty()) chosen_ = (chosen_ + 1) % axes_.size(), preferred_.clear();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (axes_[i] == std::string(1, key)) chosen_ = i, preferred_.clear();
  }
}

bool View::alive(double steady_s) const {
  return gone_.empty() && status_.is_object() && steady_s - status_steady_s_ <= kStatusTimeoutS;
}

// Current time of the data, which may differ from this machine's clock: continues from the last row.
double View::data_now_s(double steady_s) const {
  const auto found = traces_.find(charted());
  if (found == traces_.end() || found->second.points().empty()) return 0;
  return found->second.points().back().time_s + std::max(steady_s - row_steady_s_, 0.0);
}

Line View::head(double steady_s) const {
  Line line = {{instance_, Meaning::kStrong}, {"  "}};
  json age = at(status_, "age_s");
  const double since_s = steady_s - status_steady_s_;
  if (age.is_number() && since_s > kStatusFreshS) age = age.get<double>() + since_s;
  if (!alive(steady_s)) {
    line.push_back({gone_.empty() ? "prismd does not respond" : "prismd stopped", Meaning::kBad});
    line.push_back({"  " + prismctl::age_text(age) + "  "});
    line.push_back({"no_data", Meaning::kBad});
    return line;
  }
  const std::string state = text_of(at(status_, "state"));
  line.push_back({state, meaning_of_state(state)});
  line.push_back({"  " + prismctl::age_text(age) + "  "});
  const json& one = axis_status(charted());
  if (!axes_.empty()) line.push_back({charted() + " ", Meaning::kStrong});
  line.push_back({prismctl::quality_with_progress(one), meaning_of_quality(text_of(at(one, "quality")))});
  return line;
}

Line View::why(double steady_s) const {
  if (!gone_.empty()) return {{gone_ + "; retrying", Meaning::kBad}};
  if (!alive(steady_s)) return {{"no response to status requests", Meaning::kBad}};
  if (const std::string detail = text_of(at(status_, "detail"), ""); !detail.empty()) return {{detail, Meaning::kBad}};
  const json& model = at(axis_status(charted()), "model");
  const std::string name = model.is_object() ? text_of(at(model, "name"), "unnamed") : "none (uncorrected)";
  return {{fmt::format("{}, frames {}, model {}", text_of(at(status_, "device"), "no device"),
                       text_of(at(status_, "frames")), name)}};
}

// All axes side by side; the one of the charts is marked.
std::vector<Line> View::numbers_of_all(double steady_s) const {
  constexpr int kLabel = 13;
  static const json kNothing;
  const int width = std::min(22, (80 - kLabel) / static_cast<int>(axes_.size()));
  struct Row {
    const char *label, *key, *unit;
    int decimals;
  };
  constexpr Row kRows[] = {{"raw", "mean_rate_deg_per_h", " deg/h", 5},
                           {"bias", "bias_deg_per_h", " deg/h", 5},
                           {"corrected", "corrected_mean_deg_per_h", " deg/h", 5},
                           {"temperature", "mean_temperature_degc", " degC", 3}};
  std::vector<Line> lines(1, Line{{fmt::format("{:<{}}", "", kLabel)}});
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const std::string quality = text_of(at(axis_status(axes_[i]), "quality"));
    const std::string name = (i == chosen_ ? "> " : "") + axes_[i];
    lines[0].push_back({fmt::format("{:>{}}", name.substr(0, static_cast<std::size_t>(width) - 1), width),
                        alive(steady_s) ? meaning_of_quality(quality) : Meaning::kBad});
  }
  for (const Row& row : kRows) {
    Line& line = lines.emplace_back(Line{{fmt::format("{:<{}}", row.label, kLabel), Meaning::kStrong}});
    for (const std::string& name : axes_) {
      const json& axis = axis_status(name);
      const bool known = alive(steady_s) && text_of(at(axis, "quality")) != "no_data";
      line.push_back({fmt::format(
          "{:>{}}",
          value_text(at(known ? at(axis, "window") : kNothing, row.key), row.decimals, width > 15 ? row.unit : ""),
          width)});
    }
  }
  return lines;
}

std::vector<Line> View::numbers(double steady_s) const {
  if (!axes_.empty()) return numbers_of_all(steady_s);
  static const json kNothing;
  const json& w = alive(steady_s) && text_of(at(status_, "quality")) != "no_data" ? at(status_, "window") : kNothing;
  const auto number = [](const json& value) { return fmt::format("{:>13}", value_text(value, 5)); };
  const auto row = [](const char* label, const std::string& values, const char* other, const std::string& more) {
    return Line{{fmt::format("{:<10}", label), Meaning::kStrong},
                {values + std::string(static_cast<std::size_t>(std::max(40 - columns_of(values), 1)), ' ')},
                {fmt::format("{:<13}", other), Meaning::kStrong},
                {more}};
  };
  std::string sd = at(w, "sd_deg_per_h").is_number() ? " ± " + value_text(at(w, "sd_deg_per_h"), 5) : "";
  return {{{fmt::format("{:<10}{:>13}{:>13}", "deg/h", "1 s mean",
                        fmt::format("{} s mean", prismctl::mean_length_s(status_))),
            Meaning::kFaint}},
          row("raw", number(at(w, "rate_deg_per_h")) + number(at(w, "mean_rate_deg_per_h")), "temperature",
              value_text(at(w, "mean_temperature_degc"), 3, " degC")),
          row("bias", std::string(13, ' ') + number(at(w, "bias_deg_per_h")) + sd, "slope",
              value_text(at(w, "slope_degc_per_s"), 6, " degC/s")),
          row("corrected", number(at(w, "corrected_deg_per_h")) + number(at(w, "corrected_mean_deg_per_h")), "UHFO",
              value_text(at(w, "mean_uhfo_v"), 4, " V"))};
}

std::vector<Line> View::charts(int columns, int rows, double steady_s) const {
  constexpr int kFixedRows = 3;  // two titles and the axis
  ChartFrame frame;
  frame.columns = std::max(columns - kScaleColumns, 2);
  frame.rows = (rows - kFixedRows) / 2;
  if (frame.rows < 2) return {};
  frame.utf8 = utf8_;
  frame.end_s = paused_at_s_.value_or(data_now_s(steady_s));
  frame.begin_s = frame.end_s - kSpans[span_].seconds;
  static const Trace kEmpty;
  const auto trace = traces_.find(charted());
  const auto& points = (trace == traces_.end() ? kEmpty : trace->second).points();
  Bounds raw = bounds_of(points, &TracePoint::raw_deg_per_h, frame);
  Bounds corrected = bounds_of(points, &TracePoint::corrected_deg_per_h, frame);
  if (same_scale_) {
    const double span = std::max(raw.high - raw.low, corrected.high - corrected.low);
    raw = widened(raw, span), corrected = widened(corrected, span);
  }
  std::vector<Line> lines;
  const auto add = [&](const std::string& title, double TracePoint::*value, const Bounds& bounds, Meaning meaning) {
    const bool empty = !bounds.known;
    lines.push_back({{title, Meaning::kStrong}, {empty ? ": no data in this time span" : "", Meaning::kFaint}});
    for (std::string& text : chart(points, value, bounds, frame)) {
      const std::size_t scale = text.find(utf8_ ? "│" : "|");
      lines.push_back({{text.substr(0, scale), Meaning::kFaint}, {text.substr(scale), meaning}});
    }
  };
  const std::string unit = fmt::format(", {} s mean, deg/h", prismctl::window_length_s(axis_status(charted())));
  const std::string whose = axes_.empty() ? "" : charted() + ": ";
  add(whose + "raw rate" + unit, &TracePoint::raw_deg_per_h, raw, Meaning::kPlain);
  add(whose + "corrected rate" + unit, &TracePoint::corrected_deg_per_h, corrected, Meaning::kCurve);
  lines.push_back({{time_axis(frame, paused_at_s_ ? "paused" : "now"), Meaning::kFaint}});
  return lines;
}

Line View::counters() const {
  const json& line = at(status_, "line");
  Line result = {
      {fmt::format("{} frames, {} failed their check, {} missing, {} bytes skipped", count_text(at(line, "frames")),
                   count_text(at(line, "bad_check")), count_text(at(at(status_, "timing"), "missing_frames")),
                   count_text(at(line, "skipped_bytes")))}};
  const json& log = at(status_, "log");
  if (!log.is_object()) return result;
  result.push_back({fmt::format("; log {} rows", count_text(at(log, "rows")))});
  if (at(log, "dropped") != 0)
    result.push_back({fmt::format(", {} dropped", count_text(at(log, "dropped"))), Meaning::kBad});
  return result;
}

std::vector<Line> View::last_events(std::size_t count) const {
  std::vector<Line> lines(count);
  const std::size_t shown = std::min(count, events_.size());
  for (std::size_t i = 0; i < shown; ++i) lines[i] = event_line(events_[events_.size() - shown + i]);
  return lines;
}

Line View::keys() const {
  const auto key = [](const char* name) { return Piece{name, Meaning::kStrong}; };
  Line line = {key("q"),   {" quit  "},
               key("?"),   {" help  "},
               key("1-9"), {fmt::format(" span: {}  ", kSpans[span_].name)},
               key("a"),   {same_scale_ ? " scale: common  " : " scale: separate  "},
               key("p"),   {paused_at_s_ ? " resume charts" : " pause charts"}};
  if (!axes_.empty()) {
    line.push_back(key("  Tab"));
    line.push_back({" axis"});
  }
  return line;
}

namespace {

std::vector<Line> help_lines() {
  const auto spans = [](std::size_t begin, std::size_t end) {
    std::string text;
    for (std::size_t i = begin; i < end; ++i)
      text += fmt::format("{}{} {}", i > begin ? ", " : "", i + 1, kSpans[i].name);
    return text;
  };
  return {{{"Keys", Meaning::kStrong}},
          {{"  q  quit    ?  show or close this help"}},
          {{"  1-9  time span: " + spans(0, 5) + ","}},
          {{"       " + spans(5, 9)}},
          {{"  a  scale of the charts: separate, or the same span for both"}},
          {{"  p  pause the charts; numbers and state are still updated"}},
          {{"  Tab  show the next axis; x, y, z, …: show this axis"}},
          {{"Quality", Meaning::kStrong}},
          {{"  good", Meaning::kGood}, {"  correction valid"}},
          {{"  warming no_model settling fallback extrapolating slew_limited", Meaning::kWarning}, {"  caution"}},
          {{"  no_data rate_invalid input_missing over_limit implausible", Meaning::kBad}, {"  do not use"}},
          {{"  clocks_differ", Meaning::kBad}, {"  do not use: wrong rate_hz"}},
          {{"Values of a window that is not full are drawn, but do not set the scale."}}};
}

}  // namespace

std::vector<Line> View::lines(const Size& size, double steady_s, const std::string& utc) const {
  constexpr int kRoomy = 36, kFewEvents = 3, kMoreEvents = 8;
  std::vector<Line> lines = {with_right(head(steady_s), {utc, Meaning::kFaint}, size.columns), why(steady_s)};
  const auto add = [&lines](const std::vector<Line>& more) { lines.insert(lines.end(), more.begin(), more.end()); };
  add(numbers(steady_s));
  const auto events = static_cast<std::size_t>(size.rows >= kRoomy ? kMoreEvents : kFewEvents);
  constexpr int kFeet = 2;  // counters and keys
  const int room = size.rows - static_cast<int>(lines.size() + events) - kFeet;
  std::vector<Line> middle = help_ ? help_lines() : charts(size.columns, room, steady_s);
  middle.resize(static_cast<std::size_t>(std::max(room, 0)));
  add(middle);
  add(last_events(events));
  lines.push_back(counters());
  lines.resize(
      static_cast<std::size_t>(std::max(size.rows - 1, 0)));  // a screen with few rows shows its top and the keys
  lines.push_back(keys());
  for (Line& line : lines) line = fitted(line, size.columns);
  return lines;
}

}  // namespace prism::screen
