// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/second_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/plain_text.hpp"
#include "compensation/evaluation/far_runs.hpp"
#include "tools/prismcal/recordings/leave_out.hpp"

namespace prism::recordings {
namespace {

using compensation::SecondMean;
using evaluation::FarRun;

/// A quantity of the seconds, and how it is judged.
struct Quantity {
  const char *name, *unit;
  double SecondMean::*value;
  bool QuantitySet::*flag;
  double least_far;     ///< a smaller distance is never far
  double absurd;        ///< FarLimits::absurd
  bool noisy;           ///< short runs may have any value
  std::size_t stopped;  ///< fewer equal values do not show that the sensor has stopped
};

constexpr std::array<Quantity, 3> kJudged = {{
    {"rate", "deg/h", &SecondMean::rate_deg_per_h, &QuantitySet::rate, 0, 60, true, 60},
    {"temperature", "degC", &SecondMean::temperature_degc, &QuantitySet::temperature, 3, 290, false, 1000},
    {"uhfo", "V", &SecondMean::uhfo_v, &QuantitySet::uhfo, 0, 2000, false, 1000},
}};

evaluation::FarLimits far_limits(const Quantity& quantity, const std::vector<double>& values, double unit,
                                 double interval_s) {
  constexpr double kFar = 50, kCode = 8, kLongest_s = 600;
  evaluation::FarLimits limits;
  limits.far = std::max(quantity.least_far / unit, kFar * evaluation::noise_of_steps(values));
  limits.code = std::max(quantity.least_far / unit, kCode * evaluation::noise_of_steps(values));
  limits.absurd = std::max(quantity.absurd / unit, limits.far);
  const auto longest = static_cast<std::size_t>(std::max(1.0, kLongest_s / interval_s));
  limits.longest = quantity.noisy ? std::clamp<std::size_t>(values.size() / 20, 1, longest) : 0;
  limits.any_constant = true;
  return limits;
}

std::string far_text(const Quantity& quantity, const FarRun& run, const std::string& length, const std::string& first,
                     const std::string& last) {
  if (run.end - run.begin == 1)
    return fmt::format("{}: outlier at {}: {:.6g} {}, {:.3g} {} from its neighbours; not used", quantity.name, first,
                       run.level, quantity.unit, run.distance(), quantity.unit);
  return fmt::format(
      "{}: {} from {} to {} at {:.6g} {}, far from the rest (by {:.4g} {}{}): these values of {} are not used",
      quantity.name, length, first, last, run.level, quantity.unit, run.distance(), quantity.unit,
      quantity.noisy ? ": a fault, or a turn of the gyro" : "", quantity.name);
}

/// Judges one quantity.
class Judge {
 public:
  Judge(const Quantity& quantity, std::vector<SecondMean>& seconds, bool is_date)
      : quantity_(quantity), seconds_(seconds), is_date_(is_date) {
    for (std::size_t i = 0; i < seconds.size(); ++i) {
      const double value = seconds[i].*quantity.value;
      if (!std::isfinite(value) || (quantity.noisy && seconds[i].partial)) continue;
      values_.push_back(value);
      index_.push_back(i);
    }
  }

  void run() {
    constexpr std::size_t kEnough = 50;
    if (values_.size() < kEnough) return;
    leave_out_far();
    leave_out_stopped();
  }
  std::vector<std::string> notes;
  std::vector<SecondRange> explained;

 private:
  std::int64_t second(std::size_t i) const { return seconds_[index_[i]].second; }

  void leave_out_far() {
    const evaluation::FarLimits limits = far_limits(quantity_, values_, 1, 1);
    const std::vector<FarRun> far = evaluation::far_runs(values_, limits);
    for (std::size_t k = 0; k < far.size(); ++k) {
      if (k < evaluation::kFewRuns) notes.push_back(far_text(far[k]));
      leave_out(far[k].begin, far[k].end, limits.far);
    }
    if (far.size() > evaluation::kFewRuns)
      notes.push_back(fmt::format("{}: {} more at {:.6g} {}: not used", quantity_.name,
                                  counted(far.size() - evaluation::kFewRuns, "block"), far[0].level, quantity_.unit));
    forget_unknown();
  }

  void leave_out_stopped() {
    const std::vector<evaluation::ConstantRun> runs = evaluation::constant_runs(values_, quantity_.stopped);
    for (const auto& run : runs) {
      const bool is_long = 5 * (run.end - run.begin) >= values_.size();
      if (!run.certain && (quantity_.noisy || !is_long)) continue;
      notes.push_back(fmt::format(
          "{} is constant at {:.6g} {} from {} to {}: {}", quantity_.name, values_[run.begin], quantity_.unit,
          end_of_second(second(run.begin), is_date_), end_of_second(second(run.end - 1), is_date_),
          run.certain
              ? fmt::format("a stopped sensor or a code for no value; these values of {} are not used", quantity_.name)
              : "has its sensor stopped? Then " + option(run.begin, run.end)));
      if (run.certain) leave_out(run.begin, run.end, quantity_.least_far);
    }
  }

  /// "--leave-out 6001..7200".
  std::string option(std::size_t begin, std::size_t end) const {
    return "--leave-out " + leave_out_range(second(begin), second(end - 1), is_date_);
  }
  std::string far_text(const FarRun& run) const {
    return recordings::far_text(quantity_, run, fmt::format("{} s", second(run.end - 1) - second(run.begin) + 1),
                                end_of_second(second(run.begin), is_date_),
                                end_of_second(second(run.end - 1), is_date_));
  }

  void leave_out(std::size_t begin, std::size_t end, double far) {
    for (std::size_t i = begin; i < end; ++i) set(i, kUnknown);
    // The seconds next to it may contain a few of its samples.
    SecondRange range{second(begin) - 1, second(end - 1) + 1};
    for (std::size_t i = end; i < values_.size() && seconds_[index_[i]].all_implausible.*quantity_.flag; ++i) {
      if (std::fabs(values_[i] - values_[end]) > far) break;
      set(i, values_[i]);
      range.last = second(i) + 1;
    }
    explained.push_back(range);
  }
  void set(std::size_t i, double value) {
    SecondMean& mean = seconds_[index_[i]];
    mean.*quantity_.value = value;
    mean.implausible.*quantity_.flag = mean.all_implausible.*quantity_.flag = false;
  }
  /// Removes the values that were left out.
  void forget_unknown() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (!std::isfinite(seconds_[index_[i]].*quantity_.value)) continue;
      values_[kept] = values_[i];
      index_[kept++] = index_[i];
    }
    values_.resize(kept);
    index_.resize(kept);
  }

  const Quantity& quantity_;
  std::vector<SecondMean>& seconds_;
  bool is_date_;
  std::vector<double> values_;  ///< also implausible ones
  std::vector<std::size_t> index_;
};

}  // namespace

JudgedSeconds judge_seconds(std::vector<SecondMean>& second_means, bool is_date) {
  JudgedSeconds judged;
  for (std::size_t q = 0; q < kJudged.size(); ++q) {
    Judge judge(kJudged[q], second_means, is_date);
    judge.run();
    judged.notes.insert(judged.notes.end(), judge.notes.begin(), judge.notes.end());
    std::sort(judge.explained.begin(), judge.explained.end(),
              [](const SecondRange& a, const SecondRange& b) { return a.first < b.first; });
    judged.explained[q] = std::move(judge.explained);
  }
  return judged;
}

evaluation::FarLimits far_rate_limits(const std::vector<double>& rates, double unit_deg_per_h, double interval_s) {
  return far_limits(kJudged[0], rates, unit_deg_per_h, interval_s);
}

std::string far_rate_text(const FarRun& run, const std::string& length, const std::string& first,
                          const std::string& last) {
  return far_text(kJudged[0], run, length, first, last);
}

}  // namespace prism::recordings
