// SPDX-License-Identifier: MIT
// The monitor of a model over quiet gyro-years: false alarms; shifts and ageing: when are they found?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "compensation/evaluation/drift_test.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

using compensation::MonitorSettings;
using evaluation::DriftTest;

constexpr int kDay = 864, kYear = 315576, kMonth = kYear / 12;  // windows of 100 s
constexpr double kPerHour = 36;
constexpr double kAgeing_deg_per_h = 0.01;  // a month
constexpr int kShifts = 500, kAgeings = 20;

/// A gyro without a drift: what its model leaves.
struct Gyro {
  std::function<std::vector<double>()> day;  ///< any day, about the offset of its switch-on
  std::function<double()> offset;            ///< of a switch-on
  bool days_differ = true;                   ///< their means are of the offset
};

/// Feeds day after day, with a switch-on each, until `stop(window, alarm)`.
void feed(const MonitorSettings& settings, const Gyro& gyro, const std::function<double(int)>& drift,
          const std::function<bool(int, bool)>& stop) {
  DriftTest test(settings, 0, kPerHour / settings.every);
  for (int window = 0;;) {
    test.switch_on();
    const double offset = gyro.offset();
    for (const double value : gyro.day()) {
      const bool alarm = window % settings.every == 0 && test.push(offset + value + drift(window)) != 0;
      if (stop(window++, alarm)) return;
    }
  }
}

double alarms_a_year(const MonitorSettings& settings, const Gyro& gyro, int years) {
  int alarms = 0;
  feed(
      settings, gyro, [](int) { return 0.0; },
      [&](int window, bool alarm) {
        alarms += alarm;
        return window + 1 >= years * kYear;
      });
  return static_cast<double>(alarms) / years;
}

/// Share of the shifts of 1 sd, on the second day, that are found within twice the stated delay.
double found_in_time(const MonitorSettings& settings, const Gyro& gyro) {
  int found = 0;
  const double most = 2 * settings.delay_h * kPerHour;
  for (int run = 0; run < kShifts; ++run) {
    const int begin = kDay + run * kDay / kShifts;
    feed(
        settings, gyro, [&](int window) { return window < begin ? 0 : settings.sd_deg_per_h; },
        [&](int window, bool alarm) {
          const bool now = alarm && window >= begin;
          found += now;
          return now || window - begin > most;
        });
  }
  return static_cast<double>(found) / kShifts;
}

/// The drift at the alarm of a gyro that ages over daily switch-ons, in sd: the largest.
double ageing_found(const MonitorSettings& settings, const Gyro& gyro) {
  double largest = 0;
  for (int run = 0; run < kAgeings; ++run) {
    const auto drift = [&](int window) { return (run % 2 ? 1 : -1) * kAgeing_deg_per_h * window / kMonth; };
    feed(settings, gyro, drift, [&](int window, bool alarm) {
      if (alarm) largest = std::max(largest, std::abs(drift(window)) / settings.sd_deg_per_h);
      return alarm || window > kYear;
    });
  }
  return largest;
}

/// A first-order autoregressive residual.
class Autoregressive {
 public:
  static constexpr double kSd = 0.007, kOffset = 0.002;
  Autoregressive(double rho, std::uint64_t seed) : rho_(rho), random_(seed) {}
  std::vector<double> day(int length = kDay) {
    std::vector<double> values;
    for (int i = 0; i < length; ++i) {
      now_ = rho_ * now_ + std::sqrt(1 - rho_ * rho_) * normal_(random_);
      values.push_back(kSd * now_);
    }
    return values;
  }
  Gyro gyro() {
    return {[this] { return day(); }, [this] { return kOffset * normal_(random_); }, false};
  }

 private:
  double rho_, now_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

/// The settings of a long record: those of a known autocorrelation and sd.
MonitorSettings known_settings(const Gyro& gyro, int days, double offset_sd) {
  evaluation::Residuals residuals;
  for (int i = 0; i < days; ++i) {
    const std::vector<double> values = gyro.day();
    residuals.deg_per_h.insert(residuals.deg_per_h.end(), values.begin(), values.end());
    residuals.recordings.insert(residuals.recordings.end(), values.size(), gyro.days_differ ? i : 0);
  }
  return evaluation::monitor_settings(std::move(residuals), offset_sd, 0).value();
}

/// The gyros of one row, in quiet years each.
struct Row {
  std::vector<double> known, estimated, in_time, ageing;
  MonitorSettings settings, of_cycle;  ///< of the last gyro

  void add(const MonitorSettings& known_settings, const MonitorSettings& cycle_settings, const Gyro& gyro, int years) {
    settings = known_settings, of_cycle = cycle_settings;
    known.push_back(alarms_a_year(settings, gyro, years));
    in_time.push_back(found_in_time(settings, gyro));
    for (const MonitorSettings* each : {&settings, &of_cycle}) ageing.push_back(ageing_found(*each, gyro));
    estimated.push_back(alarms_a_year(of_cycle, gyro, years));
  }
  void print(const std::string& name) const {
    const double alarms = mean(known), of_cycles = mean(estimated), found = 100 * mean(in_time);
    const double drift = *std::max_element(ageing.begin(), ageing.end());
    fmt::print("| {} | {:.2f} | {:.4f} | {:.1f} | {:.1f} | {:.2f} | {:.1f} | {:.2f} | {:.1f} | {:.2f} | {:.2f} |\n",
               name, settings.correlation, settings.sd_deg_per_h, settings.threshold, settings.delay_h, alarms, found,
               of_cycle.threshold / settings.threshold, of_cycle.delay_h, of_cycles, drift);
    bar("false alarms a year, " + name, fmt::format("{:.2f}", alarms), "0.5 to 2", alarms >= 0.5 && alarms <= 2);
    bar("the same by one cycle, " + name, fmt::format("{:.2f}", of_cycles), "at most 4", of_cycles <= 4);
    bar("shifts of 1 sd within twice the delay, " + name, fmt::format("{:.1f} %", found), "95 %", found >= 95);
    bar("ageing of 0.01 deg/h a month at its alarm, " + name, fmt::format("{:.2f} sd", drift), "2", drift < 2);
    std::fflush(stdout);
  }
};

/// A model trained on one cycle, and what it leaves of `days` other days of the gyro, each with its own switch-on.
void add_truth(const Truth& truth, std::uint64_t seed, std::size_t days, int years, Row& row) {
  const training::TrainingData cycle = simulate(simulation::paper_profile(), truth.settings, seed).data;
  const training::TrainedModel trained = fitted(kContenders.front(), cycle);
  std::vector<std::vector<double>> left;
  std::vector<double> offsets;
  for (std::size_t day = 1; day <= days; ++day) {
    const training::TrainingData data = simulate(simulation::paper_profile(), truth.settings, seed + day).data;
    const Eigen::VectorXd error = data.target - biases_of(*trained.model, data);
    offsets.push_back(error.mean());
    const Eigen::VectorXd centred = error.array() - error.mean();
    left.emplace_back(centred.begin(), centred.end());
  }
  // The first half gives the known settings, the second half the years.
  std::size_t next = 0;
  const std::size_t half = days / 2;
  std::mt19937_64 random(seed);
  const Gyro first{[&] { return left[next++]; }, [] { return 0.0; }},
      second{[&] { return left[half + random() % half]; }, [&] { return offsets[half + random() % half]; }};
  double squares = 0;
  for (const double offset : offsets) squares += offset * offset / static_cast<double>(days);
  const auto of_cycle = training::monitor_of(trained.held_out, *trained.model->info().spread, training::runs_of(cycle),
                                             cycle.time_s, 100);
  row.add(known_settings(first, static_cast<int>(half), std::sqrt(squares)), of_cycle.value(), second, years);
}

}  // namespace

int monitor(std::uint64_t first_seed, int count) {
  constexpr int kYears = 200, kLongRecord = 7300, kCycle = 924;
  constexpr std::size_t kDaysSimulated = 400;
  fmt::print(
      "| residual | correlation | sd, deg/h | threshold, sd | delay, h | false alarms a year | shift in time, % | by "
      "one "
      "cycle: threshold, of this | delay, h | false alarms a year | ageing found, sd |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const int years = std::max(1, kYears / count);
  for (const double rho : {0.0, 0.3, 0.6}) {
    Row row;
    for (int g = 0; g < count; ++g) {
      Autoregressive residual(rho, first_seed + static_cast<std::uint64_t>(g));
      const Gyro gyro = residual.gyro();
      const evaluation::Residuals cycle{residual.day(kCycle), std::vector<int>(kCycle, 0), 1, 100};
      row.add(known_settings(gyro, kLongRecord, Autoregressive::kOffset),
              evaluation::monitor_settings(cycle, Autoregressive::kOffset, 0).value(), gyro, years);
    }
    row.print(fmt::format("ρ {:.1f}", rho));
  }
  for (const Truth& truth : truths()) {
    Row row;
    for (int g = 0; g < count; ++g)
      add_truth(truth, first_seed + 1000 * static_cast<std::uint64_t>(g), kDaysSimulated, years, row);
    row.print(truth.name);
  }
  return 0;
}

}  // namespace prism::science
