// SPDX-License-Identifier: MIT
#include "tools/prismcal/model_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "base/text_number.hpp"
#include "compensation/at_rest.hpp"
#include "compensation/block_stability.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::analysis {
namespace {

constexpr double kBin_degc = 10, kFewestDegc = 0.25, kCertain = 2, kMoreNoise = 1.5, kOver_h = 168;
constexpr std::int64_t kSwitchOn_s = 60, kHour_s = 3600;

/// Settings of the monitor with the length of a window.
struct Basis {
  compensation::MonitorSettings settings;
  double window_s;

  double hours(const std::vector<RestMean>& means) const {
    return static_cast<double>(means.size()) * window_s / kHour_s;
  }
  MeanDifference mean(const std::vector<RestMean>& means) const { return mean_difference(means, settings, window_s); }
};

std::vector<RestMean> between(const std::vector<RestMean>& means, double low_degc, double high_degc) {
  std::vector<RestMean> kept;
  std::copy_if(means.begin(), means.end(), std::back_inserter(kept), [&](const RestMean& one) {
    return one.temperature_degc >= low_degc && one.temperature_degc < high_degc;
  });
  return kept;
}

/// Where the drift began: the index of its first mean; the number of means without a drift at the end.
std::size_t find_drift(const Basis& basis, const std::vector<RestMean>& means, double mount_sd) {
  const compensation::MonitorSettings& settings = basis.settings;
  const double value_s = basis.window_s * settings.every;
  evaluation::DriftTest test(settings, mount_sd, kHour_s / value_s);
  std::size_t begin = means.size(), last_alarm = 0;
  std::vector<std::size_t> values;  // their means
  const double over = std::max(2 * settings.delay_h, kOver_h) * kHour_s / value_s;
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (i == 0 || means[i].run != means[i - 1].run) test.switch_on();
    if (!values.empty() && static_cast<double>(means[i].second - means[values.back()].second) < value_s) continue;
    values.push_back(i);
    if (static_cast<double>(values.size() - last_alarm) > over) begin = means.size();
    const auto length = static_cast<std::size_t>(std::abs(test.push(means[i].difference_deg_per_h)));
    if (length == 0) continue;
    if (begin == means.size()) begin = values[values.size() - length];
    last_alarm = values.size();
  }
  return begin;
}

/// "drifted since 2026-10-03: +0.006 ± 0.001 deg/h above 40 degC", and the likely cause.
void describe_drift(MonitorResult& result, const Basis& basis, const std::vector<RestMean>& before,
                    const std::vector<RestMean>& since, double middle_degc) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const auto change = [&](double low_degc, double high_degc) {
    MeanDifference after = basis.mean(between(since, low_degc, high_degc));
    const MeanDifference first = basis.mean(between(before, low_degc, high_degc));
    if (std::isfinite(first.deg_per_h)) {
      after.deg_per_h -= first.deg_per_h;
      after.within_sd = std::hypot(after.within_sd, first.within_sd), after.sd = std::hypot(after.sd, first.sd);
    }
    return after;
  };
  MeanDifference all = change(-kAny, kAny);
  const MeanDifference cold = change(-kAny, middle_degc), hot = change(middle_degc, kAny);
  const double slope = hot.deg_per_h - cold.deg_per_h;
  std::vector<double> differences;
  for (const RestMean& one : since) differences.push_back(one.difference_deg_per_h);
  const double noisier = evaluation::noise_floor(differences, {}).value_or(0) /
                         (basis.settings.sd_deg_per_h * std::sqrt(1 - basis.settings.correlation));
  std::string where;
  if (std::abs(slope) > kCertain * std::hypot(hot.within_sd, cold.within_sd) &&
      std::abs(slope) > std::abs(all.deg_per_h) / 4) {
    result.cause = "a slope over temperature: the thermal response aged; train again";
    const bool is_hot = std::abs(hot.deg_per_h) > std::abs(cold.deg_per_h);
    all = is_hot ? hot : cold;
    where = fmt::format(" {} {:.0f} degC", is_hot ? "above" : "below", middle_degc);
  } else if (noisier > kMoreNoise && std::abs(all.deg_per_h) < kCertain * all.sd) {
    result.cause = fmt::format("more noise, {:.1f} times that of the training: vibration, or the gyro's own", noisier);
  } else {
    result.cause = "an offset at all temperatures seen: the bias moved, or the axis";
  }
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(all.sd))), 0, 5);
  result.text =
      fmt::format("drifted since {}: {:+.{}f} ± {:.{}f} deg/h{}", utc_text(since.front().second).substr(0, 10),
                  all.deg_per_h, decimals, all.sd, decimals, where);
}

/// The whole degrees that the means cover, and the width of the training range; nullopt without one of T.
std::optional<std::pair<std::size_t, double>> degrees_seen(const compensation::ModelInfo& info,
                                                           const std::vector<RestMean>& means) {
  const auto t = std::ranges::find(info.inputs, compensation::kInputTemperature);
  if (t == info.inputs.end() || info.domain.min.empty()) return std::nullopt;
  const auto i = static_cast<std::size_t>(t - info.inputs.begin());
  std::set<double> seen;
  for (const RestMean& mean : means) seen.insert(std::floor(mean.temperature_degc));
  return std::pair(seen.size(), info.domain.max[i] - info.domain.min[i]);
}

/// Hours, mean difference and its sd.
void put(std::vector<report::Cell>& row, const std::vector<RestMean>& means, const Basis& basis) {
  const MeanDifference mean = basis.mean(means);
  row.push_back(report::fixed_cell(basis.hours(means), 1));
  for (const double value : {mean.deg_per_h, mean.sd}) row.push_back(report::fixed_cell(value, 4));
}

report::Table temperature_table(const std::vector<RestMean>& before, const std::vector<RestMean>& since, double low,
                                double high, const Basis& basis) {
  report::Table table{"temperatures", "Corrected rate minus Earth rate by temperature", "",
                      report::columns("from [degC] | to [degC] | at rest [h] | difference [deg/h] | ± [deg/h]")};
  if (!since.empty())
    table.columns = report::columns(
        "from [degC] | to [degC] | before [h] | difference [deg/h] | ± [deg/h] | since [h] | "
        "difference [deg/h] | ± [deg/h]");
  for (double from = kBin_degc * std::floor(low / kBin_degc); from <= high; from += kBin_degc) {
    const double to = from + kBin_degc;
    table.rows.push_back({report::fixed_cell(from, 0), report::fixed_cell(to, 0)});
    put(table.rows.back(), between(before, from, to), basis);
    if (!since.empty()) put(table.rows.back(), between(since, from, to), basis);
  }
  return table;
}

report::Table switch_on_table(const std::vector<RestMean>& means, const Basis& basis) {
  report::Table table{"switch_ons", "Offset of each switch-on", "",
                      report::columns("begin: | at rest [h] | offset [deg/h] | ± [deg/h]")};
  std::vector<double> offsets;
  for (std::size_t i = 0, end = 0; i < means.size(); i = end) {
    while (end < means.size() && means[end].run == means[i].run) ++end;
    const std::vector<RestMean> run(means.begin() + static_cast<std::ptrdiff_t>(i),
                                    means.begin() + static_cast<std::ptrdiff_t>(end));
    if (basis.hours(run) >= 1) offsets.push_back(basis.mean(run).deg_per_h);
    table.rows.push_back({utc_text(means[i].second)});
    put(table.rows.back(), run, basis);
  }
  if (const auto spread = evaluation::summarise(offsets, evaluation::Divisor::kNMinus1))
    table.caption = fmt::format("Repeatability (1 sigma): {:.4f} deg/h.", spread->sd);
  return table;
}

}  // namespace

MeanDifference mean_difference(const std::vector<RestMean>& means, const compensation::MonitorSettings& settings,
                               double window_s) {
  if (means.empty()) return {};
  std::map<std::int64_t, compensation::RunningVariance> in_hour;
  std::set<int> runs;
  compensation::RunningVariance all;
  for (const RestMean& one : means) {
    in_hour[one.second / kHour_s].add(one.difference_deg_per_h);
    all.add(one.difference_deg_per_h);
    runs.insert(one.run);
  }
  std::vector<double> hours;
  for (const auto& [hour, values] : in_hour) hours.push_back(values.mean());
  const double r = std::clamp(evaluation::neighbour_correlation(hours), 0.0, 0.9);
  double sd = settings.sd_deg_per_h * std::sqrt(window_s / kHour_s);  // at least that of white residuals
  if (const auto summary = evaluation::summarise(hours, evaluation::Divisor::kNMinus1)) sd = std::max(sd, summary->sd);
  const double within_sd = sd * std::sqrt((1 + r) / (1 - r) / static_cast<double>(hours.size()));
  return {all.mean(), within_sd, std::hypot(within_sd, settings.offset_deg_per_h / std::sqrt(double(runs.size())))};
}

Result<std::vector<RestMean>> means_at_rest(const compensation::ModelPtr& model, const recordings::BlockTable& table,
                                            const CorrectionSettings& correction) {
  const auto noise = compensation::noise_of(model->info());
  if (!noise)
    return make_error(model->info().name, "states no noise; expected a model trained by prismcal 0.3 or later");
  compensation::CompensationEngine engine(correction.engine);
  if (auto used = engine.use(model, nullptr); !used) return tl::unexpected<Error>(used.error());
  const compensation::RestLimits limits = compensation::rest_limits(*noise, table.features.length_s);
  const std::vector<double> sds = table.second_sds();
  const int history_s = compensation::history_s(table.features);
  std::vector<RestMean> kept, row;  // row: neighbours at rest
  const auto end_row = [&] {
    if (row.size() >= compensation::AtRest::kFewestBlocks) kept.insert(kept.end(), row.begin(), row.end());
    row.clear();
  };
  int run = 0;
  auto restart = table.restarts.begin();
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!table.follows[i]) {
      engine.break_off();
      end_row();
    }
    const std::int64_t begin_s = table.second(i) - history_s;
    run += i > 0 && begin_s - table.second(i - 1) >= kSwitchOn_s;
    for (; restart != table.restarts.end() && *restart <= table.second(i); ++restart) run += i > 0;
    const compensation::Correction found = engine.follow(table.blocks[i]);
    const double difference = compensation::corrected_rate(table.bias_deg_per_h[i], found);
    if (found.quality != compensation::kGood || !(sds[i] <= limits.second_sd_deg_per_h) ||
        !(std::abs(difference) <= limits.difference_deg_per_h)) {
      end_row();
      continue;
    }
    if (!row.empty() && std::abs(difference - row.back().difference_deg_per_h) > limits.step_deg_per_h) end_row();
    row.push_back({table.second(i), table.blocks[i].temperature_degc, difference, run, found.sd_deg_per_h});
  }
  end_row();
  return kept;
}

MonitorResult monitor(const compensation::ModelInfo& info, const compensation::MonitorSettings& settings,
                      const std::vector<RestMean>& means, double mount_sd_deg_per_h) {
  MonitorResult result{"too_little", "too little seen: the gyro was not at rest inside the training range", "", {}};
  if (means.empty()) return result;
  const Basis basis{settings, double(info.features.length_s)};
  const auto begin = means.begin() + static_cast<std::ptrdiff_t>(find_drift(basis, means, mount_sd_deg_per_h));
  const std::vector<RestMean> before(means.begin(), begin), since(begin, means.end());
  const auto [low, high] = std::ranges::minmax_element(means, {}, &RestMean::temperature_degc);
  result.tables = {temperature_table(before, since, low->temperature_degc, high->temperature_degc, basis),
                   switch_on_table(means, basis)};
  const double hours = basis.hours(means);
  const auto degrees = degrees_seen(info, means);
  if (!since.empty()) {
    result.verdict = "drifted";
    describe_drift(result, basis, before, since, (low->temperature_degc + high->temperature_degc) / 2);
  } else if (hours < 2 * settings.delay_h) {
    result.text = fmt::format("too little seen: {:.0f} of {:.0f} h at rest", hours, std::ceil(2 * settings.delay_h));
  } else if (degrees && static_cast<double>(degrees->first) < kFewestDegc * degrees->second) {
    result.text = fmt::format("too little seen: {} of {:.0f} degC", degrees->first, degrees->second);
  } else {
    result.verdict = "holds";
    result.text = fmt::format("holds: {:.0f} days, {:.0f} h at rest, {:.0f} to {:.0f} degC seen",
                              std::ceil(static_cast<double>(means.back().second - means.front().second) / 86400), hours,
                              low->temperature_degc, high->temperature_degc);
  }
  return result;
}

std::string MonitorResult::json_text() const {
  report::Report report;
  report.title = "Monitor";
  report.facts = {{"verdict", verdict}, {"text", text}, {"cause", cause}};
  report.sections = {{"monitor", "Monitor", {tables.begin(), tables.end()}}};
  return report::json_text(report);
}

std::string MonitorResult::plain_text() const {
  std::string all = text + "\n" + (cause.empty() ? "" : "likely cause: " + cause + "\n");
  for (const report::Table& table : tables) all += "\n" + report::plain_text(table);
  return all;
}

}  // namespace prism::analysis
