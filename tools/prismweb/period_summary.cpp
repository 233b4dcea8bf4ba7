// SPDX-License-Identifier: MIT
#include "tools/prismweb/period_summary.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

namespace prism::prismweb {
namespace {

constexpr std::array<std::int64_t, 18> kSteps = {1,   2,   5,    10,   15,   30,    60,    120,   300,
                                                 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400};

double number_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : std::numeric_limits<double>::quiet_NaN();
}

// Value of the second. prismd before 0.2 sends only the window's mean.
double second_or_mean(const nlohmann::json& window, const char* of_second, const char* of_window) {
  return number_of(window, window.contains(of_second) ? of_second : of_window);
}

std::uint32_t count_of(const nlohmann::json& object, const char* key) {
  const double number = number_of(object, key);
  return number >= 0 && number < 4e9 ? static_cast<std::uint32_t>(number) : 0;
}

PeriodSummary of_values(std::int64_t begin_s, const std::array<double, kQuantities>& values) {
  PeriodSummary second;
  second.begin_s = begin_s;
  second.min = second.max = values;
  for (std::size_t i = 0; i < kMeans; ++i) second.mean[i].take(values[i]);
  second.seconds = 1;
  return second;
}

}  // namespace

// fmin and fmax ignore NaN.
void PeriodSummary::add(const PeriodSummary& other) {
  for (std::size_t i = 0; i < kQuantities; ++i) {
    min[i] = std::fmin(min[i], other.min[i]);
    max[i] = std::fmax(max[i], other.max[i]);
  }
  for (std::size_t i = 0; i < kMeans; ++i) {
    mean[i].sum += other.mean[i].sum;
    mean[i].known += other.mean[i].known;
  }
  samples += other.samples;
  missing += other.missing;
  seconds += other.seconds;
  good += other.good;
}

PeriodValues values_of(const PeriodSummary& period) {
  PeriodValues values{};
  std::size_t count = 0;
  const auto put = [&](double value) { values[count++] = value; };
  for (std::size_t i = 0; i < kQuantities; ++i) {
    if (i != kSd) put(period.min[i]);
    put(period.max[i]);
  }
  for (const KnownMean& mean : period.mean) put(mean.value());
  for (const std::uint32_t one : {period.samples, period.missing, period.seconds, period.good}) put(one);
  for (const KnownMean& mean : period.mean) put(mean.known);
  return values;
}

PeriodSummary period_of(std::int64_t begin_s, const PeriodValues& values) {
  PeriodSummary period;
  period.begin_s = begin_s;
  std::size_t count = 0;
  const auto take = [&] { return values[count++]; };
  for (std::size_t i = 0; i < kQuantities; ++i) {
    if (i != kSd) period.min[i] = take();
    period.max[i] = take();
  }
  period.min[kSd] = period.max[kSd];
  for (KnownMean& mean : period.mean) mean.sum = take();
  for (std::uint32_t* const one : {&period.samples, &period.missing, &period.seconds, &period.good})
    *one = static_cast<std::uint32_t>(take());
  for (KnownMean& mean : period.mean) {
    mean.known = static_cast<std::uint32_t>(take());
    mean.sum = mean.known > 0 ? mean.sum * mean.known : 0;
  }
  return period;
}

PeriodSummary second_of(const compensation::CompensatedWindow& row) {
  const compensation::SecondMean& second_mean = row.window.second_mean;
  PeriodSummary second =
      of_values(second_mean.second, {second_mean.rate_deg_per_h, row.corrected_deg_per_h, row.correction.bias_deg_per_h,
                                     row.correction.sd_deg_per_h, second_mean.temperature_degc,
                                     row.window.slope_degc_per_s, second_mean.uhfo_v});
  second.samples = static_cast<std::uint32_t>(second_mean.samples);
  second.missing = static_cast<std::uint32_t>(second_mean.missing_frames);
  second.good = row.correction.quality == compensation::kGood ? 1 : 0;
  return second;
}

std::optional<PeriodSummary> second_of(const nlohmann::json& window) {
  if (!window.is_object()) return std::nullopt;
  const double end_s = number_of(window, "time_s");
  if (!(std::fabs(end_s) < 1e10)) return std::nullopt;
  PeriodSummary second =
      of_values(std::llround(end_s) - 1,
                {number_of(window, "rate_deg_per_h"), number_of(window, "corrected_deg_per_h"),
                 number_of(window, "bias_deg_per_h"), number_of(window, "sd_deg_per_h"),
                 second_or_mean(window, "temperature_degc", "mean_temperature_degc"),
                 number_of(window, "slope_degc_per_s"), second_or_mean(window, "uhfo_v", "mean_uhfo_v")});
  second.samples = count_of(window, "samples");
  second.missing = count_of(window, "missing");
  second.good = window.value("quality", nlohmann::json()) == "good" ? 1 : 0;
  return second;
}

std::int64_t floor_to(std::int64_t time_s, std::int64_t length_s) {
  const std::int64_t rest = time_s % length_s;
  return time_s - (rest < 0 ? rest + length_s : rest);
}

// Plus 1, because the limits of the range may cut two steps.
std::int64_t step_for(double length_s, int points, std::int64_t min_s) {
  const auto fits = [&](std::int64_t step) {
    return step >= min_s && length_s / static_cast<double>(step) + 1 <= std::max(points, 2);
  };
  const auto found = std::find_if(kSteps.begin(), kSteps.end(), fits);
  if (found != kSteps.end()) return *found;
  return kSteps.back() *
         static_cast<std::int64_t>(std::ceil(length_s / static_cast<double>(kSteps.back()) / std::max(points - 1, 1)));
}

std::vector<PeriodSummary> downsample(std::span<const PeriodSummary> periods, std::int64_t from_s, std::int64_t to_s,
                                      std::int64_t step_s) {
  std::vector<PeriodSummary> steps;
  bool in_order = true;
  for (const PeriodSummary& period : periods) {
    if (period.begin_s < from_s || period.begin_s >= to_s) continue;
    const std::int64_t begin_s = floor_to(period.begin_s, step_s);
    if (steps.empty() || steps.back().begin_s != begin_s) {
      in_order = in_order && (steps.empty() || steps.back().begin_s < begin_s);
      steps.push_back(period);
      steps.back().begin_s = begin_s;
    } else {
      steps.back().add(period);
    }
  }
  if (in_order) return steps;
  std::map<std::int64_t, PeriodSummary> sorted;  // the clock was set back
  for (const PeriodSummary& step : steps) {
    const auto [at, is_new] = sorted.emplace(step.begin_s, step);
    if (!is_new) at->second.add(step);
  }
  steps.clear();
  for (const auto& [begin_s, step] : sorted) steps.push_back(step);
  return steps;
}

}  // namespace prism::prismweb
