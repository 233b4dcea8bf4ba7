// SPDX-License-Identifier: MIT
// The monitor of a model over quiet gyro-years: false alarms; shifts and ageing: when are they found?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <future>
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

/// The errors of a model on any day of its gyro without a drift, with the offset of the switch-on.
using Gyro = std::function<std::vector<double>()>;

/// Feeds day after day, with a switch-on each, until `stop(window, alarm)`.
void feed(const MonitorSettings& settings, const Gyro& day, const std::function<double(int)>& drift,
          const std::function<bool(int, bool)>& stop) {
  DriftTest test(settings, 0, kPerHour / settings.every);
  for (int window = 0;;) {
    test.switch_on();
    for (const double value : day()) {
      const bool alarm = window % settings.every == 0 && test.push(value + drift(window)) != 0;
      if (stop(window++, alarm)) return;
    }
  }
}

double alarms_a_year(const MonitorSettings& settings, const Gyro& gyro, int years) {
  int alarms = 0;
  for (int year = 0; year < years; ++year) {
    feed(
        settings, gyro, [](int) { return 0.0; },
        [&](int window, bool alarm) {
          alarms += alarm;
          return window + 1 >= kYear;
        });
  }
  return static_cast<double>(alarms) / years;
}

/// Share of the shifts of 1 sd, up and down, on the eighth day that are found within twice the stated delay.
double found_in_time(const MonitorSettings& settings, const Gyro& gyro) {
  int found = 0;
  const double most = 2 * settings.delay_h * kPerHour;
  for (int run = 0; run < kShifts; ++run) {
    const int begin = 7 * kDay + run * kDay / kShifts;
    const double shift = run % 2 ? settings.sd_deg_per_h : -settings.sd_deg_per_h;
    feed(
        settings, gyro, [&](int window) { return window < begin ? 0 : shift; },
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

/// A first-order autoregressive residual, and offsets of switch-ons.
class Autoregressive {
 public:
  static constexpr double kSd = 0.007, kOffset = 0.002;
  Autoregressive(double rho, std::uint64_t seed) : rho_(rho), random_(seed) {}
  std::vector<double> cycle(int length, double offset = 0) {
    std::vector<double> values;
    for (int i = 0; i < length; ++i) {
      now_ = rho_ * now_ + std::sqrt(1 - rho_ * rho_) * normal_(random_);
      values.push_back(offset + kSd * now_);
    }
    return values;
  }
  std::vector<double> day() { return cycle(kDay, kOffset * normal_(random_)); }

 private:
  double rho_, now_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

/// The settings of a long record: those of a known autocorrelation and sd.
MonitorSettings known_settings(const Gyro& day, int days) {
  evaluation::Residuals residuals;
  for (int i = 0; i < days; ++i) {
    const std::vector<double> values = day();
    residuals.deg_per_h.insert(residuals.deg_per_h.end(), values.begin(), values.end());
    residuals.recordings.insert(residuals.recordings.end(), values.size(), i);
  }
  return evaluation::monitor_settings(std::move(residuals), 0, 0).value();
}

/// One gyro in quiet years.
struct Outcome {
  MonitorSettings known, of_cycle;
  double alarms_a_year = 0, of_cycle_a_year = 0, in_time = 0, ageing = 0, of_cycle_ageing = 0;
};

Outcome outcome_of(const MonitorSettings& known, const MonitorSettings& of_cycle, const Gyro& gyro, int years) {
  return {known,
          of_cycle,
          alarms_a_year(known, gyro, years),
          alarms_a_year(of_cycle, gyro, years),
          found_in_time(known, gyro),
          ageing_found(known, gyro),
          ageing_found(of_cycle, gyro)};
}

/// The gyros of one row.
struct Row {
  std::vector<Outcome> gyros;

  /// Runs `count` gyros at once.
  Row(int count, const std::function<Outcome(int)>& run) {
    std::vector<std::future<Outcome>> running;
    for (int g = 0; g < count; ++g) running.push_back(std::async(std::launch::async, run, g));
    for (auto& one : running) gyros.push_back(one.get());
  }
  double mean_of(double Outcome::*number) const {
    double sum = 0;
    for (const Outcome& one : gyros) sum += one.*number;
    return sum / static_cast<double>(gyros.size());
  }
  double largest(double Outcome::*number) const {
    double most = 0;
    for (const Outcome& one : gyros) most = std::max(most, one.*number);
    return most;
  }
  void print(const std::string& name) const {
    const double alarms = mean_of(&Outcome::alarms_a_year), of_cycles = mean_of(&Outcome::of_cycle_a_year),
                 found = 100 * mean_of(&Outcome::in_time), known_drift = largest(&Outcome::ageing),
                 cycle_drift = largest(&Outcome::of_cycle_ageing), drift = std::max(known_drift, cycle_drift);
    const MonitorSettings &settings = gyros.back().known, &of_cycle = gyros.back().of_cycle;
    fmt::print(
        "| {} | {:.2f} | {:.4f} | {:.1f} | {:.1f} | {:.2f} | {:.1f} | {:.2f} | {:.2f} | {:.1f} | {:.2f} | {:.2f} |\n",
        name, settings.correlation, settings.sd_deg_per_h, settings.threshold, settings.delay_h, alarms, found,
        known_drift, of_cycle.threshold / settings.threshold, of_cycle.delay_h, of_cycles, cycle_drift);
    bar("false alarms a year, " + name, fmt::format("{:.2f}", alarms), "0.5 to 2", alarms >= 0.5 && alarms <= 2);
    bar("the same by one cycle, " + name, fmt::format("{:.2f}", of_cycles), "at most 4", of_cycles <= 4);
    bar("shifts of 1 sd within twice the delay, " + name, fmt::format("{:.1f} %", found), "95 %", found >= 95);
    bar("ageing of 0.01 deg/h a month at its alarm, " + name, fmt::format("{:.2f} sd", drift), "2", drift < 2);
    std::fflush(stdout);
  }
};

/// The errors of the model on a day, in the windows that the monitor takes: those inside its training range. The
/// model's variance costs much, and only inputs beyond those of the training make it large.
std::vector<double> left_of(const compensation::Model& model, const training::TrainingData& day) {
  const compensation::Domain& domain = model.info().domain;
  const Eigen::VectorXd bias = biases_of(model, day);
  std::vector<double> left;
  for (Eigen::Index i = 0; i < bias.size(); ++i) {
    const Eigen::VectorXd x = day.inputs.col(i);
    bool inside = true;
    for (std::size_t k = 0; k < domain.min.size(); ++k) inside &= x[k] >= domain.min[k] && x[k] <= domain.max[k];
    if (inside || !predict_within(model, {x.data(), domain.min.size()}, kContenders.front().policy).extrapolating)
      left.push_back(day.target[i] - bias[i]);
  }
  return left;
}

/// A model trained on one cycle, and its errors on `days` other days of the gyro, each with its own switch-on.
Outcome of_truth(const Truth& truth, std::uint64_t seed, std::size_t days, int years) {
  const training::TrainingData cycle = simulate(simulation::paper_profile(), truth.settings, seed).data;
  const training::TrainedModel trained = fitted(kContenders.front(), cycle);
  std::vector<std::vector<double>> left;
  for (std::size_t day = 1; day <= days; ++day) {
    left.push_back(left_of(*trained.model, simulate(simulation::paper_profile(), truth.settings, seed + day).data));
  }
  // The first half gives the known settings, the second half the years.
  std::size_t next = 0;
  const std::size_t half = days / 2;
  std::mt19937_64 random(seed);
  const Gyro first = [&] { return left[next++]; }, second = [&] { return left[half + random() % half]; };
  const auto of_cycle = training::monitor_of(trained.held_out, *trained.model->info().spread, training::runs_of(cycle),
                                             cycle.time_s, 100);
  return outcome_of(known_settings(first, static_cast<int>(half)), of_cycle.value(), second, years);
}

}  // namespace

int monitor(std::uint64_t first_seed, int count) {
  constexpr int kYears = 200, kLongRecord = 7300, kCycle = 924;
  constexpr std::size_t kDays = 600, kDaysOfRareErrors = 2000;  // without hysteresis, few days have alarms
  fmt::print(
      "| residual | correlation | sd, deg/h | threshold, sd | delay, h | false alarms a year | shift in time, % | "
      "ageing "
      "found, sd | by one cycle: threshold, of this | delay, h | false alarms a year | ageing found, sd |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  const int years = std::max(1, kYears / count);
  for (const double rho : {0.0, 0.3, 0.6}) {
    const Row row(count, [&](int g) {
      Autoregressive residual(rho, first_seed + static_cast<std::uint64_t>(g));
      const Gyro gyro = [&] { return residual.day(); };
      const evaluation::Residuals cycle{residual.cycle(kCycle), std::vector<int>(kCycle, 0), 1, 100};
      return outcome_of(known_settings(gyro, kLongRecord),
                        evaluation::monitor_settings(cycle, Autoregressive::kOffset, 0).value(), gyro, years);
    });
    row.print(fmt::format("ρ {:.1f}", rho));
  }
  for (const Truth& truth : truths()) {
    const Row row(count, [&](int g) {
      return of_truth(truth, first_seed + 10000 * static_cast<std::uint64_t>(g),
                      truth.settings.hysteresis_deg_per_h > 0 ? kDays : kDaysOfRareErrors, years);
    });
    row.print(truth.name);
  }
  return 0;
}

}  // namespace prism::science
