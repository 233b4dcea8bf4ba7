// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/input_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace prism::commands {
namespace {

/// Returns true if a sensor is the thermometer of T itself: their difference would only be rounding.
bool is_own_thermometer(const recordings::Recording& recording, std::size_t sensor) {
  constexpr double kSame_degc = 0.02;
  return std::all_of(recording.second_means.begin(), recording.second_means.end(),
                     [&](const compensation::SecondMean& second_mean) {
                       return sensor >= second_mean.sensors.size() ||
                              !(std::fabs(second_mean.sensors[sensor] - second_mean.temperature_degc) > kSame_degc);
                     });
}

/// Candidate inputs of a recording: T, dTdt, U, the lags, and for each sensor its difference to T (if in degC, else its
/// value) and its slope. Omits quantities known in 90 % of the seconds or less, and sensors that equal T.
Result<std::vector<std::string>> candidates_of(const TrainChoice& choice) {
  const auto recording = recordings::read_recording(choice.files.front(), choice.recordings.source);
  if (!recording) return tl::unexpected<Error>(recording.error());
  const auto often = [&](auto value_of) {
    const auto known = std::count_if(recording->second_means.begin(), recording->second_means.end(),
                                     [&](const auto& second_mean) { return std::isfinite(value_of(second_mean)); });
    return 10 * static_cast<std::size_t>(known) > 9 * recording->second_means.size();
  };
  std::vector<std::string> names = {"T", "dTdt"};
  if (often([](const compensation::SecondMean& second_mean) { return second_mean.uhfo_v; })) names.emplace_back("U");
  const std::size_t lags = choice.recordings.features.lag_time_constants_s.size();
  for (std::size_t i = 1; i <= lags; ++i) names.push_back(fmt::format("lag{}", i));
  const std::vector<SensorName> sensors = recording->sensors();
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    if (!often([i](const compensation::SecondMean& second_mean) {
          return i < second_mean.sensors.size() ? second_mean.sensors[i] : kUnknown;
        }))
      continue;
    const SensorName& sensor = sensors[i];
    if (sensor.unit == "degC" && is_own_thermometer(*recording, i)) continue;
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
