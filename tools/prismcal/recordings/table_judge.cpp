// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "compensation/evaluation/statistics.hpp"

namespace prism::recordings {
namespace {

constexpr std::array<const char*, 3> kNames = {"rate", "temperature", "uhfo"}, kUnitNames = {"deg/h", "degC", "V"};

bool equal(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

std::string time_text(std::int64_t second, bool is_date) {
  return is_date ? utc_text(second + 1) : fmt::format("{} s", second + 1);
}

/// Median of the values around `at`, without it.
double around(const std::vector<double>& values, std::size_t at) {
  std::vector<double> near;
  for (std::size_t i = at - std::min<std::size_t>(at, 10); i < std::min(values.size(), at + 11); ++i) {
    if (i != at) near.push_back(values[i]);
  }
  return near.empty() ? kUnknown : evaluation::median_of(std::move(near));
}

}  // namespace

TableJudge::TableJudge() : plausibility_(compensation::PlausibilityLimits{}) {}

void TableJudge::push(Sample& sample, std::size_t line) {
  const bool repeats = any_ && equal(sample.rate_deg_per_h, last_.rate_deg_per_h) && sample.time_ns == last_.time_ns &&
                       equal(sample.temperature_degc, last_.temperature_degc) && equal(sample.uhfo_v, last_.uhfo_v);
  if (repeats && ++repeated_ == 1) first_repeated_line_ = line;
  last_ = sample;
  any_ = true;
  compensation::Rejections rejections;
  const QuantitySet implausible = plausibility_.implausible(sample);
  if (implausible.any()) plausibility_.explain(sample, implausible, rejections);
  const auto judge = [&](std::size_t quantity, double& value, bool bad, const compensation::Rejection& why) {
    Count& count = counts_[quantity];
    if (std::isnan(value)) return;
    ++count.values;
    count.like_kelvin += value > 230 && value < 375;
    follow_jump(count, quantity, value, bad, why, line);
    if (!bad) return;
    if (++count.implausible == 1) {
      count.first_line = line;
      count.why = compensation::rejection_text(why, kUnitNames[quantity]);
    }
    value = kUnknown;
  };
  judge(0, sample.rate_deg_per_h, implausible.rate, rejections.rate);
  judge(1, sample.temperature_degc, implausible.temperature, rejections.temperature);
  judge(2, sample.uhfo_v, implausible.uhfo, rejections.uhfo);
}

void TableJudge::follow_jump(Count& count, std::size_t quantity, double value, bool bad,
                             const compensation::Rejection& why, std::size_t line) {
  if (bad) {
    if (!count.jump.is_rejecting()) count.jump_line = line;
    return count.jump.reject(why);
  }
  const auto jump = count.jump.accept(value);
  if (jump && count.question.empty())
    count.question = fmt::format(
        "{} jumps from {:.6g} to {:.6g} {} in line {} and stays: a fault, or true? If it is a "
        "fault, train without the rows after it",
        kNames[quantity], jump->before, jump->after, kUnitNames[quantity], count.jump_line);
}

Result<std::vector<std::string>> TableJudge::finish(const std::string& path) const {
  std::vector<std::string> notes;
  for (std::size_t q = 0; q < counts_.size(); ++q) {
    const Count& count = counts_[q];
    if (count.implausible == 0) continue;
    const std::string text = fmt::format("{}: {} of {} values implausible, the first in line {}: {}", kNames[q],
                                         count.implausible, count.values, count.first_line, count.why);
    if (q == 1 && 2 * count.like_kelvin > count.values)
      return make_error(path, text + "; looks like kelvin: --map temperature=COLUMN:K");
    if (100 * count.implausible > count.values) return make_error(path, text + "; expected at most 1 %");
    notes.push_back(text + "; left out");
    if (!count.question.empty()) notes.push_back(count.question);
  }
  if (repeated_ > 0)
    notes.push_back(fmt::format("{} repeats the row before it with its time, the first in line {}",
                                counted(repeated_, "row"), first_repeated_line_));
  return notes;
}

std::vector<std::string> judge_seconds(std::vector<compensation::SecondMean>& second_means, bool is_date) {
  constexpr std::size_t kFew = 5, kEnough = 50, kConstant_s = 1000;
  constexpr double kFar = 50;
  std::vector<std::string> notes;
  std::vector<double> rates;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    if (!std::isfinite(second_means[i].rate_deg_per_h) || second_means[i].partial) continue;
    rates.push_back(second_means[i].rate_deg_per_h);
    index.push_back(i);
  }
  if (rates.size() < kEnough) return notes;
  std::vector<double> steps;
  for (std::size_t i = 1; i < rates.size(); ++i) steps.push_back(rates[i] - rates[i - 1]);
  const double noise = evaluation::robust_sd(steps) / std::sqrt(2.0);
  std::vector<std::size_t> far;
  for (std::size_t i = 0; noise > 0 && i < rates.size() && far.size() <= kFew; ++i) {
    if (std::fabs(steps[std::min(i, steps.size() - 1)]) < kFar * noise &&
        (i == 0 || std::fabs(steps[i - 1]) < kFar * noise))
      continue;
    if (std::fabs(rates[i] - around(rates, i)) > kFar * noise) far.push_back(i);
  }
  for (const std::size_t i : far) {
    if (far.size() > kFew) break;
    compensation::SecondMean& second_mean = second_means[index[i]];
    notes.push_back(fmt::format("outlier at {}: {:.6g} deg/h, {:.3g} times the noise from its neighbours; left out",
                                time_text(second_mean.second, is_date), rates[i],
                                std::fabs(rates[i] - around(rates, i)) / noise));
    second_mean.rate_deg_per_h = kUnknown;
  }
  // A thermometer that stops: constant to the last digit after it has moved, for longer than its steps take.
  std::size_t begin = 0, longest = 0, longest_begin = 0;
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    const double temperature = second_means[i].temperature_degc;
    if (std::isfinite(temperature)) low = std::min(low, temperature), high = std::max(high, temperature);
    if (i > 0 && temperature != second_means[i - 1].temperature_degc) begin = i;
    if (i - begin + 1 > longest && std::isfinite(temperature)) longest = i - begin + 1, longest_begin = begin;
  }
  if (longest >= kConstant_s && 5 * longest >= second_means.size() && high > low)
    notes.push_back(fmt::format("temperature stays at {:.6g} degC from {} to {}: has its sensor stopped?",
                                second_means[longest_begin].temperature_degc,
                                time_text(second_means[longest_begin].second, is_date),
                                time_text(second_means[longest_begin + longest - 1].second, is_date)));
  return notes;
}

}  // namespace prism::recordings
