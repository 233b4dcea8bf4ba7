// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/input_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

namespace prism::commands {
namespace {

/// Counts the seconds in which quantities are known.
class KnownCounter : public recordings::SecondConsumer {
 public:
  Result<void> begin(const recordings::Recording& recording) override {
    sensors_.resize(recording.sensors().size());
    return {};
  }
  Result<void> push(const compensation::SecondMean& second_mean, bool) override {
    constexpr double kSame_degc = 0.02;
    ++seconds_;
    uhfo_ += std::isfinite(second_mean.uhfo_v);
    for (std::size_t i = 0; i < std::min(sensors_.size(), second_mean.sensors.size()); ++i) {
      sensors_[i].known += std::isfinite(second_mean.sensors[i]);
      sensors_[i].differs |= std::fabs(second_mean.sensors[i] - second_mean.temperature_degc) > kSame_degc;
    }
    return {};
  }
  bool uhfo_often() const { return often(uhfo_); }
  bool often_known(std::size_t sensor) const { return often(sensors_[sensor].known); }
  /// Returns true if a sensor is the thermometer of T itself: their difference would only be rounding.
  bool is_own_thermometer(std::size_t sensor) const { return !sensors_[sensor].differs; }

 private:
  struct Sensor {
    std::size_t known = 0;
    bool differs = false;
  };
  bool often(std::size_t known) const { return 10 * known > 9 * seconds_; }

  std::size_t seconds_ = 0, uhfo_ = 0;
  std::vector<Sensor> sensors_;
};

/// Candidate inputs of a recording: T, dTdt, U, the lags, and for each sensor its difference to T (if in degC, else its
/// value) and its slope. Omits quantities known in 90 % of the seconds or less, and sensors that equal T.
Result<std::vector<std::string>> candidates_of(const TrainChoice& choice) {
  KnownCounter counter;
  recordings::SourceOptions source = choice.recordings.source;
  source.several = true;  // the training checks the ranges of --leave-out
  const auto recording = recordings::read_recording(choice.files.front(), source, counter);
  if (!recording) return tl::unexpected<Error>(recording.error());
  std::vector<std::string> names = {"T", "dTdt"};
  if (counter.uhfo_often()) names.emplace_back("U");
  const std::size_t lags = choice.recordings.features.lag_time_constants_s.size();
  for (std::size_t i = 1; i <= lags; ++i) names.push_back(fmt::format("lag{}", i));
  const std::vector<SensorName> sensors = recording->sensors();
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    if (!counter.often_known(i)) continue;
    const SensorName& sensor = sensors[i];
    if (sensor.unit == "degC" && counter.is_own_thermometer(i)) continue;
    names.push_back(sensor.unit == "degC" ? sensor.name + "-T" : sensor.name);
    names.push_back("d" + sensor.name + "/dt");
  }
  return names;
}

double gain_percent(const training::InputSearch& search, const training::InputSet& set) {
  return 100 * (1 - set.error_deg_per_h / search.without_deg_per_h);
}

}  // namespace

Result<training::InputSearch> choose_inputs(const TrainChoice& choice) {
  const auto candidates = candidates_of(choice);
  if (!candidates) return tl::unexpected<Error>(candidates.error());
  const auto set = recordings::read_training_set(choice.files, *candidates, choice.recordings);
  if (!set) return tl::unexpected<Error>(set.error());
  return training::search_inputs(set->data);
}

std::string search_text(const training::InputSearch& search) {
  std::string text = fmt::format(
      "inputs, error of second-order polynomials on held-out parts; without inputs {:.5f} deg/h; each input alone\n",
      search.without_deg_per_h);
  const auto line = [&](const std::string& name, const training::InputSet& set, const char* mark) {
    text += fmt::format("  {:<36} {:.5f} ± {:.5f} deg/h  {:6.1f} %{}\n", name, set.error_deg_per_h,
                        set.standard_error_deg_per_h, gain_percent(search, set), mark);
  };
  for (const training::InputSet& set : search.alone) line(set.inputs.front(), set, "");
  text += "added one by one, the largest improvement first\n";
  for (std::size_t i = 0; i < search.path.size(); ++i) {
    line((i > 0 ? "+ " : "") + search.path[i].inputs.back(), search.path[i],
         i == search.chosen ? "  chosen: the smallest set within one standard error of the best" : "");
  }
  return text;
}

nlohmann::ordered_json search_json(const training::InputSearch& search) {
  const auto sets = [&](const std::vector<training::InputSet>& of) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const training::InputSet& set : of)
      json.push_back({{"inputs", set.inputs},
                      {"error_deg_per_h", set.error_deg_per_h},
                      {"standard_error_deg_per_h", set.standard_error_deg_per_h},
                      {"gain_percent", gain_percent(search, set)}});
    return json;
  };
  return {{"without_deg_per_h", search.without_deg_per_h},
          {"alone", sets(search.alone)},
          {"path", sets(search.path)},
          {"chosen", search.best().inputs}};
}

}  // namespace prism::commands
