// SPDX-License-Identifier: MIT
#include "tools/prismcal/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "compensation/evaluation/irregularities.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::recordings {
namespace {

using compensation::Rejection, compensation::SecondMean;

/// A quantity, and how it is judged.
struct Quantity {
  const char *name, *unit;
  double SecondMean::*value;
  bool QuantitySet::*flag;
  double least_far;  ///< a smaller distance is never far
  double absurd;     ///< FarLimits::absurd
  bool noisy;        ///< short runs may have any value
  double stopped;    ///< fewer equal values, or a shorter time in s, do not show that the sensor has stopped
};

constexpr std::array<Quantity, 3> kJudged = {{
    {"rate", "deg/h", &SecondMean::rate_deg_per_h, &QuantitySet::rate, 0, 60, true, 60},
    {"temperature", "degC", &SecondMean::temperature_degc, &QuantitySet::temperature, 3, 290, false, 1000},
    {"uhfo", "V", &SecondMean::uhfo_v, &QuantitySet::uhfo, 0, 2000, false, 1000},
}};

/// Values of a quantity, some of them unknown.
struct Values {
  std::vector<double>& values;
  double unit = 1;                                                         ///< of a value of 1, in the quantity's unit
  double interval_s = 1;                                                   ///< about, between two values
  std::function<std::string(std::size_t first, std::size_t last)> length;  ///< in texts
  std::function<std::string(std::size_t index)> time;
  /// Called for each run of values that are not used, before they are made unknown. `far`: the least distance of such a
  /// run.
  std::function<void(Finding& finding, double far)> leave_out;
};

evaluation::FarLimits far_limits(const Quantity& quantity, const std::vector<double>& known, const Values& all) {
  constexpr double kFar = 50, kCode = 8, kLongest_s = 600;
  const double noise = evaluation::noise_of_steps(known), least = quantity.least_far / all.unit;
  evaluation::FarLimits limits;
  limits.far = std::max(least, kFar * noise);
  limits.code = std::max(least, kCode * noise);
  limits.absurd = std::max(quantity.absurd / all.unit, limits.far);
  const auto longest = static_cast<std::size_t>(std::max(1.0, kLongest_s / all.interval_s));
  limits.longest = quantity.noisy ? std::clamp<std::size_t>(known.size() / 20, 1, longest) : 0;
  limits.any_constant = true;
  return limits;
}

std::string far_text(const Quantity& quantity, const evaluation::FarRun& run, std::size_t first, std::size_t last,
                     const Values& all) {
  const double level = run.level * all.unit, distance = run.distance() * all.unit;
  if (first == last)
    return fmt::format("{}: outlier at {}: {:.6g} {}, {:.3g} {} from its neighbours; not used", quantity.name,
                       all.time(first), level, quantity.unit, distance, quantity.unit);
  return fmt::format(
      "{}: {} from {} to {} at {:.6g} {}, far from the rest (by {:.4g} {}{}): these values of {} are not used",
      quantity.name, all.length(first, last), all.time(first), all.time(last), level, quantity.unit, distance,
      quantity.unit, quantity.noisy ? ": a fault, or a turn of the gyro" : "", quantity.name);
}

/// Judges one quantity, and makes what is not used unknown.
std::vector<Finding> judge(const Quantity& quantity, const Values& all) {
  constexpr std::size_t kEnough = 50;
  std::vector<double> known;
  std::vector<std::size_t> index;  // of each of them
  const auto find_known = [&] {
    known.clear();
    index.clear();
    for (std::size_t i = 0; i < all.values.size(); ++i) {
      if (std::isfinite(all.values[i])) known.push_back(all.values[i]), index.push_back(i);
    }
  };
  std::vector<Finding> findings;
  const auto leave_out = [&](const char* kind, std::string text, std::size_t first, std::size_t last, double far) {
    findings.push_back({kind,
                        std::move(text),
                        Severity::kRemark,
                        {},
                        static_cast<std::int64_t>(first),
                        static_cast<std::int64_t>(last)});
    if (all.leave_out) all.leave_out(findings.back(), far);
    std::fill(all.values.begin() + static_cast<std::ptrdiff_t>(first),
              all.values.begin() + static_cast<std::ptrdiff_t>(last + 1), kUnknown);
  };
  find_known();
  if (known.size() < kEnough) return {};
  const evaluation::FarLimits limits = far_limits(quantity, known, all);
  const std::vector<evaluation::FarRun> far = evaluation::far_runs(known, limits);
  for (std::size_t k = 0; k < far.size(); ++k) {
    const std::size_t first = index[far[k].begin], last = index[far[k].end - 1];
    std::string text;
    if (k < evaluation::kFewRuns)
      text = far_text(quantity, far[k], first, last, all);
    else if (k == evaluation::kFewRuns)
      text = fmt::format("{}: {} more at {:.6g} {}: not used", quantity.name, counted(far.size() - k, "run"),
                         far[0].level * all.unit, quantity.unit);
    leave_out("far", std::move(text), first, last, limits.far);
  }
  if (!far.empty()) find_known();
  const auto stopped = static_cast<std::size_t>(std::max(quantity.stopped, quantity.stopped / all.interval_s));
  for (const evaluation::ConstantRun& run : evaluation::constant_runs(known, stopped)) {
    const bool is_long = 5 * (run.end - run.begin) >= known.size();
    if (!run.certain && (quantity.noisy || !is_long)) continue;
    const std::size_t first = index[run.begin], last = index[run.end - 1];
    const std::string text = fmt::format("{} is constant at {:.6g} {} from {} to {}: ", quantity.name,
                                         known[run.begin] * all.unit, quantity.unit, all.time(first), all.time(last));
    if (run.certain)
      leave_out("constant",
                fmt::format("{}a stopped sensor or a code for no value; these values of {} are not used", text,
                            quantity.name),
                first, last, quantity.least_far);
    else
      findings.push_back({"constant", text + "has its sensor stopped?", Severity::kRemark, "Then",
                          static_cast<std::int64_t>(first), static_cast<std::int64_t>(last)});
  }
  return findings;
}

std::vector<Finding> judge_quantity(const Quantity& quantity, std::vector<SecondMean>& seconds, bool is_date) {
  std::vector<double> values;
  for (const SecondMean& mean : seconds)
    values.push_back(quantity.noisy && mean.partial ? kUnknown : mean.*quantity.value);
  const auto second = [&](std::size_t i) { return seconds[i].second; };
  const auto forgive = [&](SecondMean& mean) {
    mean.implausible.*quantity.flag = mean.all_implausible.*quantity.flag = false;
  };
  const auto leave_out = [&](Finding& finding, double far) {
    std::size_t i = static_cast<std::size_t>(finding.begin);
    for (; i <= static_cast<std::size_t>(finding.end); ++i) {
      if (!std::isfinite(values[i])) continue;
      seconds[i].*quantity.value = kUnknown;
      forgive(seconds[i]);
    }
    // Those that returned too fast.
    for (double first = kUnknown; i < seconds.size(); ++i) {
      if (!std::isfinite(values[i])) continue;
      if (std::isnan(first)) first = values[i];
      if (!(seconds[i].all_implausible.*quantity.flag) || std::fabs(values[i] - first) > far) break;
      forgive(seconds[i]);
      finding.end = static_cast<std::int64_t>(i);
    }
  };
  std::vector<Finding> findings =
      judge(quantity,
            {values, 1, 1,
             [&](std::size_t first, std::size_t last) { return fmt::format("{} s", second(last) - second(first) + 1); },
             [&](std::size_t i) { return end_of_second(second(i), is_date); }, leave_out});
  for (Finding& finding : findings) {
    finding.begin = second(static_cast<std::size_t>(finding.begin));
    finding.end = second(static_cast<std::size_t>(finding.end));
    if (!finding.advice.empty())
      finding.advice += " --leave-out " + leave_out_range(finding.begin, finding.end, is_date);
  }
  return findings;
}

/// A temperature in degC that is probably one in kelvin.
bool like_kelvin(double degc) { return degc > 230 && degc < 375; }

constexpr double kLeastEarthRate_deg_per_h = 0.5;

}  // namespace

void add_remarks(std::vector<Finding>& findings, const std::string& kind, const std::vector<std::string>& texts) {
  for (const std::string& text : texts)
    if (!text.empty()) findings.push_back({kind, text});
}

std::vector<std::string> lines_of(const std::vector<Finding>& findings, Severity severity) {
  std::vector<std::string> lines;
  for (const Finding& finding : findings) {
    if (finding.severity == severity && !finding.text.empty()) lines.push_back(finding.line());
  }
  return lines;
}

std::array<std::vector<Finding>, 3> judge_seconds(std::vector<SecondMean>& second_means, bool is_date) {
  std::array<std::vector<Finding>, 3> findings;
  for (std::size_t q = 0; q < kJudged.size(); ++q) findings[q] = judge_quantity(kJudged[q], second_means, is_date);
  return findings;
}

std::vector<Finding> judge_rates(std::vector<double>& rates, const RateRows& rows) {
  const auto time = [&](std::size_t row) {
    if (row >= rows.stamps_ns.size()) return fmt::format("row {}", row + 1);
    constexpr double kMs_ns = 1e6;
    return tables::time_text(std::llround(static_cast<double>(rows.stamps_ns[row]) / kMs_ns) * 1'000'000, rows.is_date);
  };
  const auto length = [](std::size_t first, std::size_t last) { return counted(last - first + 1, "row"); };
  return judge(kJudged[0], {rates, rows.unit_deg_per_h, rows.interval_s, length, time, nullptr});
}

QuantitySet RowJudge::push(const Sample& sample, std::size_t line) {
  compensation::Rejections rejections;
  const QuantitySet implausible = plausibility_.implausible(sample);
  if (implausible.any()) plausibility_.explain(sample, implausible, rejections);
  const auto count = [&](Count& of, double value, bool bad, const Rejection& why) {
    if (std::isnan(value)) return;
    ++of.values;
    of.like_kelvin += like_kelvin(value);
    if (!bad) return;
    const std::int64_t second = compensation::second_number(sample.time_ns);
    if (of.rejected.empty() || of.rejected.back().second != second) of.rejected.push_back({second, 0, line, why});
    ++of.rejected.back().values;
  };
  count(counts_[0], sample.rate_deg_per_h, implausible.rate, rejections.rate);
  count(counts_[1], sample.temperature_degc, implausible.temperature, rejections.temperature);
  count(counts_[2], sample.uhfo_v, implausible.uhfo, rejections.uhfo);
  return implausible;
}

Result<std::vector<Finding>> RowJudge::finish(const std::string& path,
                                              const std::array<std::vector<Finding>, 3>& of_seconds) const {
  std::vector<Finding> findings;
  for (std::size_t q = 0; q < counts_.size(); ++q) {
    const Count& count = counts_[q];
    std::vector<Finding> explained = of_seconds[q];
    std::erase_if(explained, [](const Finding& finding) { return !finding.advice.empty(); });  // its values are used
    std::ranges::sort(explained, {}, &Finding::begin);
    const Rejected* first = nullptr;
    std::size_t implausible = 0;
    for (const Rejected& rejected : count.rejected) {
      // The seconds next to values that are not used may have a few of their samples.
      const auto at = std::ranges::lower_bound(explained, rejected.second - 1, {}, &Finding::end);
      if (at != explained.end() && at->begin - 1 <= rejected.second) continue;
      if (first == nullptr) first = &rejected;
      implausible += rejected.values;
    }
    if (first == nullptr) continue;
    const std::string text =
        fmt::format("{}: {} of {} values implausible, the first in line {}: {}", kJudged[q].name, implausible,
                    count.values, first->first_line, compensation::rejection_text(first->why, kJudged[q].unit));
    if (q == 1 && 2 * count.like_kelvin > count.values)
      return make_error(path, text + "; looks like kelvin: --map temperature=COLUMN:K");
    if (100 * implausible > count.values) return make_error(path, text + "; expected at most 1 %");
    findings.push_back({"implausible", text + "; left out"});
  }
  for (const auto& some : of_seconds) findings.insert(findings.end(), some.begin(), some.end());
  return findings;
}

double rounding_step(const std::vector<Series>& rates) {
  constexpr std::size_t kRun = 3, kMost = 1000, kEnough = 2;
  std::size_t known = 0, in_runs = 0;
  double last = kUnknown;
  std::vector<double> steps;
  for (const auto& [start_s, values] : rates) {
    for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
      for (end = begin + 1; end < values.size() && values[end] == values[begin];) ++end;
      if (!std::isfinite(values[begin])) continue;
      known += end - begin;
      if (end - begin < kRun) continue;
      in_runs += end - begin;
      const double step = std::fabs(values[begin] - std::exchange(last, values[begin]));
      if (step > 0 && steps.size() < kMost) steps.push_back(step);
    }
  }
  if (steps.size() < kEnough || 2 * in_runs < known) return 0;
  return evaluation::median_of(std::move(steps));
}

void JumpFinder::push(const SecondMean& second_mean, bool begins_session) {
  if (begins_session) watch_ = {};
  if (begins_session) last_degc_ = kUnknown;
  const double now = second_mean.temperature_degc;
  if (second_mean.implausible.temperature) {
    // A log does not state the quantity: a smaller step is not the temperature's.
    const double step = compensation::PlausibilityLimits{}.temperature.step;
    const bool rejects = second_mean.all_implausible.temperature && std::isfinite(now) && !std::isnan(last_degc_) &&
                         (watch_.is_rejecting() || std::fabs(now - last_degc_) > step);
    if (!rejects) return;
    if (!watch_.is_rejecting()) from_ = second_mean.second;
    until_ = second_mean.second;
    watch_.reject({Rejection::Reason::kTooFast, now, last_degc_, last_degc_});
    return;
  }
  if (!std::isfinite(now)) return;
  last_degc_ = now;
  const auto stayed = watch_.accept(now);
  if (!stayed) return;
  if (!jumps_.empty() && !jumps_.back().to) {
    Jump& open = jumps_.back();
    if (std::fabs(now - open.values.before) < std::fabs(now - open.values.after)) {
      open.to = until_;
      return;
    }
  }
  jumps_.push_back({*stayed, from_, std::nullopt});
}

std::vector<Finding> JumpFinder::findings(bool is_date) const {
  std::vector<Finding> findings;
  for (const Jump& jump : jumps_) {
    findings.push_back({"jump",
                        fmt::format("temperature jumped from {:.1f} to {:.1f} degC at {} and {}: a fault, or true?",
                                    jump.values.before, jump.values.after, end_of_second(jump.from, is_date),
                                    jump.to ? "back at " + end_of_second(*jump.to, is_date) : "stayed"),
                        Severity::kQuestion,
                        "If it is a fault: --leave-out " + leave_out_range(jump.from, jump.to, is_date), jump.from,
                        jump.to.value_or(until_)});
  }
  return findings;
}

std::optional<std::string> likely_unit(double mean_deg_per_h, double earth_rate_deg_per_h) {
  constexpr double kTolerance = 0.3;  // of the Earth rate: the bias of a gyro that detects it
  const double earth = earth_rate_deg_per_h;
  const auto is_earth = [earth](double rate) { return std::abs(rate - earth) < kTolerance * std::abs(earth); };
  if (std::abs(earth) < kLeastEarthRate_deg_per_h || is_earth(mean_deg_per_h)) return std::nullopt;
  for (const tables::Unit& unit : tables::kUnits) {
    if (unit.quantity != "rate" || unit.factor == 1) continue;
    if (is_earth(mean_deg_per_h * unit.factor)) return std::string(unit.name);
    if (is_earth(mean_deg_per_h / unit.factor)) return "deg/h";
  }
  return std::nullopt;
}

Result<void> check_unit(double mean_deg_per_h, double earth_rate_deg_per_h, const std::string& name) {
  constexpr double kGreatestAtRest_deg_per_h = 5 * 3600;  // values of deg/h that are taken for deg/s have more
  if (const auto unit = likely_unit(mean_deg_per_h, earth_rate_deg_per_h))
    return make_error(name, fmt::format("the mean rate is {:.3g} deg/h, but the site's Earth rate {:.3g} deg/h if the "
                                        "values are in {}; expected the unit {} in --map or the frame description, or "
                                        "--accept-unit",
                                        mean_deg_per_h, earth_rate_deg_per_h, *unit, *unit));
  if (std::abs(mean_deg_per_h) >= kGreatestAtRest_deg_per_h)
    return make_error(name,
                      fmt::format("the mean rate is {:.3g} deg/s, expected a gyro at rest (below 5 deg/s); are the "
                                  "values in deg/h? The unit is in --map or the frame description; --accept-unit",
                                  mean_deg_per_h / 3600));
  return {};
}

std::optional<Finding> sign_question(double mean_deg_per_h, double earth_rate_deg_per_h) {
  constexpr double kNear = 0.1;  // of the Earth rate: chance hardly leads a large bias there
  const double earth = earth_rate_deg_per_h;
  if (std::abs(earth) < kLeastEarthRate_deg_per_h || !(std::abs(mean_deg_per_h + earth) < kNear * std::abs(earth)))
    return std::nullopt;
  return Finding{"sign",
                 fmt::format("the mean rate is {:.3g} deg/h, the site's Earth rate {:.3g} deg/h: has the rate or the "
                             "elevation the wrong sign?",
                             mean_deg_per_h, earth),
                 Severity::kQuestion};
}

std::string spikes_text(const std::vector<Series>& rates) {
  constexpr double kFar = 20, kMost = 0.2;  // robust sd; share of the seconds
  std::size_t seconds = 0;
  for (const Series& series : rates) seconds += series.values.size();
  double middle = 0;
  const auto median_of = [&](const auto& value_of) {  // one copy at a time: a year has 250 MB
    std::vector<double> values;
    values.reserve(seconds);
    for_each_known(rates, [&](std::int64_t, double rate) { values.push_back(value_of(rate)); });
    return values.empty() ? 0 : evaluation::median_of(std::move(values));
  };
  const auto distance_of = [&](double rate) { return std::abs(rate - middle); };
  middle = median_of([](double rate) { return rate; });
  const double limit = kFar * 1.4826 * median_of(distance_of);
  if (!(limit > 0)) return {};
  std::size_t known = 0, far = 0, runs = 0;
  double most = 0;
  bool is_far = false;
  for_each_known(rates, [&](std::int64_t, double rate) {
    const bool was_far = std::exchange(is_far, distance_of(rate) > limit);
    ++known;
    far += is_far;
    runs += is_far && !was_far;
    most = std::max(most, distance_of(rate));
  });
  if (far == 0 || 2 * runs < far || static_cast<double>(far) > kMost * static_cast<double>(known)) return {};
  return fmt::format(
      "the rate has {} of {} seconds far from the rest, by up to {:.3g} deg/h: shocks, or a fault of the line?", far,
      known, most);
}

// Times that are not used.

std::string end_of_second(std::int64_t second, bool is_date) {
  return is_date ? utc_text(second + 1) : fmt::format("{} s", second + 1);
}

std::string leave_out_range(std::int64_t first, std::optional<std::int64_t> last, bool is_date) {
  const auto end = [&](std::int64_t second) { return is_date ? utc_text(second + 1) : fmt::format("{}", second + 1); };
  return end(first) + ".." + (last ? end(*last) : "");
}

LeaveOut::LeaveOut(const std::vector<std::string>& ranges) {
  for (const std::string& text : ranges) ranges_.push_back({text});
}

Result<void> LeaveOut::begin(std::int64_t first_second, bool is_date) {
  if (std::exchange(begun_, true)) return {};
  const auto seconds_of = [&](const std::string& text, double open) -> std::optional<double> {
    constexpr double kSinceStart = 1e8;  // smaller numbers are seconds since the start: 1e8 s since 1970 is in 1973
    if (text.empty()) return open;
    if (const auto number = parse_number<double>(text))
      return is_date && *number < kSinceStart ? *number + static_cast<double>(first_second) : *number;
    const auto date = tables::iso_time(text);
    return date && is_date ? std::optional(static_cast<double>(date->ns) / 1e9) : std::nullopt;
  };
  for (Range& range : ranges_) {
    const std::size_t dots = range.text.size() > 2 ? range.text.find("..") : std::string::npos;
    const bool has_dots = dots != std::string::npos;
    const auto from_s = has_dots ? seconds_of(range.text.substr(0, dots), -HUGE_VAL) : std::nullopt,
               to_s = has_dots ? seconds_of(range.text.substr(dots + 2), HUGE_VAL) : std::nullopt;
    if (!from_s || !to_s)
      return make_error("--leave-out",
                        fmt::format("found \"{}\", expected FROM..TO, as {}", range.text,
                                    is_date ? "2026-11-23T09:11:00Z..2026-11-23T09:12:00Z or 7001..7031 (s)"
                                            : "7001..7031 (s): the recording's times have no date"));
    if (*from_s > *to_s)
      return make_error("--leave-out", fmt::format("found \"{}\", which ends before it begins", range.text));
    range.from_s = *from_s, range.to_s = *to_s;
  }
  return {};
}

bool LeaveOut::contains(std::int64_t second) {
  const auto begin = static_cast<double>(second);
  const bool counted_before = last_ == second;
  last_ = second;
  bool any = false;
  for (Range& range : ranges_) {
    if (begin + 1 < range.from_s || begin >= range.to_s) continue;
    range.seconds += !counted_before;
    any = true;
  }
  return any;
}

std::vector<std::string> LeaveOut::unmatched() const {
  std::vector<std::string> texts;
  for (const Range& range : ranges_) {
    if (range.seconds == 0) texts.push_back(range.text);
  }
  return texts;
}

std::vector<std::string> LeaveOut::notes() const {
  std::vector<std::string> notes;
  for (const Range& range : ranges_)
    notes.push_back(fmt::format("--leave-out {}: {} left out", range.text, counted(range.seconds, "second")));
  return notes;
}

}  // namespace prism::recordings
