// SPDX-License-Identifier: MIT
#include "compensation/features.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace prism::compensation {
namespace {

/// The parsed name of an input.
struct InputTerm {
  enum class Kind { kMean, kSlope, kDifference } kind = Kind::kMean;
  std::string first, second;  // quantities: T, U or a sensor
};

std::optional<InputTerm> parse_term(const std::string& name) {
  if (name == kInputSlope) return InputTerm{InputTerm::Kind::kSlope, kInputTemperature, ""};
  const auto is_quantity = [](const std::string& text) {
    return text == kInputTemperature || text == kInputUhfo || is_sensor_name(text);
  };
  if (is_quantity(name)) return InputTerm{InputTerm::Kind::kMean, name, ""};
  if (name.size() > 4 && name.front() == 'd' && name.ends_with("/dt")) {
    const std::string sensor = name.substr(1, name.size() - 4);
    return is_sensor_name(sensor) ? std::optional(InputTerm{InputTerm::Kind::kSlope, sensor, ""}) : std::nullopt;
  }
  const std::size_t minus = name.find('-');
  if (minus == std::string::npos) return std::nullopt;
  const std::string first = name.substr(0, minus), second = name.substr(minus + 1);
  if (!is_quantity(first) || !is_quantity(second) || first == second) return std::nullopt;
  return InputTerm{InputTerm::Kind::kDifference, first, second};
}

/// The unit of a quantity; empty if the definition does not have it.
std::string unit_of(const FeatureDefinition& definition, const std::string& quantity) {
  if (quantity == kInputTemperature) return "degC";
  if (quantity == kInputUhfo) return "V";
  const std::size_t index = sensor_index(definition.sensors, quantity);
  return index < definition.sensors.size() ? definition.sensors[index].unit : "";
}

}  // namespace

int history_s(const FeatureDefinition& definition) {
  const bool difference = definition.slope == SlopeMethod::kDifference;
  return definition.length_s + (difference ? definition.end_mean_s : 0);
}

bool is_slope(const std::string& input) {
  const auto term = parse_term(input);
  return term && term->kind == InputTerm::Kind::kSlope;
}

std::vector<std::string> sensors_of(const std::vector<std::string>& inputs) {
  std::vector<std::string> sensors;
  for (const std::string& input : inputs) {
    const auto term = parse_term(input);
    if (!term) continue;
    for (const std::string& name : {term->first, term->second}) {
      const bool known = std::find(sensors.begin(), sensors.end(), name) != sensors.end();
      if (is_sensor_name(name) && !known) sensors.push_back(name);
    }
  }
  return sensors;
}

bool has_input(const FeatureDefinition& definition, const std::string& name) {
  const auto term = parse_term(name);
  if (!term) return false;
  const std::string unit = unit_of(definition, term->first);
  return !unit.empty() && (term->kind != InputTerm::Kind::kDifference || unit == unit_of(definition, term->second));
}

std::string unit_of_input(const FeatureDefinition& definition, const std::string& name) {
  const auto term = parse_term(name);
  if (!term) return "";
  return unit_of(definition, term->first) + (term->kind == InputTerm::Kind::kSlope ? "/s" : "");
}

double input_value(const Window& window, const FeatureDefinition& definition, const std::string& name) {
  if (name == kInputTemperature) return window.temperature_degc;
  if (name == kInputSlope) return window.slope_degc_per_s;
  if (name == kInputUhfo) return window.uhfo_v;
  const auto term = parse_term(name);
  if (!term) return kUnknown;
  const auto of = [&](const std::string& quantity) {
    if (quantity == kInputTemperature) return SensorWindow{window.temperature_degc, window.slope_degc_per_s};
    if (quantity == kInputUhfo) return SensorWindow{window.uhfo_v};
    const std::size_t index = sensor_index(definition.sensors, quantity);
    return index < window.sensors.size() ? window.sensors[index] : SensorWindow();
  };
  const SensorWindow first = of(term->first);
  if (term->kind == InputTerm::Kind::kSlope) return first.slope_per_s;
  return term->kind == InputTerm::Kind::kMean ? first.mean : first.mean - of(term->second).mean;
}

namespace {

// The mean of one quantity over the one-second means of some seconds that contain it.
struct MeanValue {
  double mean = kUnknown;
  double mean_time_s = 0;  // of the seconds that contain it, relative to the window's last second
  int count = 0;
  std::int64_t longest_gap_s = 0;
};

// The one-second means in [first, last]; relative times keep the sums small.
template <class Quantity>
MeanValue mean_value(const std::deque<SecondMean>& history, Quantity value_of, std::int64_t first, std::int64_t last) {
  MeanValue result;
  double sum = 0;
  std::int64_t time_sum_s = 0, next = first;
  for (const SecondMean& second_mean : history) {
    if (second_mean.second < first || second_mean.second > last) continue;
    const double value = value_of(second_mean);
    if (!std::isfinite(value)) continue;
    sum += value;
    time_sum_s += second_mean.second - last;
    ++result.count;
    result.longest_gap_s = std::max(result.longest_gap_s, second_mean.second - next);
    next = second_mean.second + 1;
  }
  result.longest_gap_s = std::max(result.longest_gap_s, last + 1 - next);
  if (result.count == 0) return result;
  result.mean = sum / result.count;
  result.mean_time_s = static_cast<double>(time_sum_s) / result.count;
  return result;
}

// Slope of the least-squares line through (second, value) in [first, last].
template <class Quantity>
double least_squares_slope(const std::deque<SecondMean>& history, Quantity value_of, std::int64_t first,
                           std::int64_t last, const MeanValue& mean) {
  double covariance = 0, variance = 0;
  for (const SecondMean& second_mean : history) {
    const double value = value_of(second_mean);
    if (second_mean.second < first || !std::isfinite(value)) continue;
    const double dt = static_cast<double>(second_mean.second - last) - mean.mean_time_s;
    covariance += dt * (value - mean.mean);
    variance += dt * dt;
  }
  return variance > 0 ? covariance / variance : kUnknown;
}

// On a steady ramp both methods return the exact slope, with or without gaps: they use the times of the data.
template <class Quantity>
double slope_of(const std::deque<SecondMean>& history, Quantity value_of, const FeatureDefinition& definition,
                std::int64_t last) {
  const std::int64_t first = last - definition.length_s + 1;
  const auto values = [&](std::int64_t from, std::int64_t to) { return mean_value(history, value_of, from, to); };
  if (definition.slope == SlopeMethod::kLeastSquares) {
    const MeanValue all = values(first, last);
    return all.longest_gap_s > definition.max_gap_s ? kUnknown
                                                    : least_squares_slope(history, value_of, first, last, all);
  }
  const MeanValue now = values(last - definition.end_mean_s + 1, last);
  const MeanValue before = values(first - definition.end_mean_s, first - 1);
  if (std::max(now.longest_gap_s, before.longest_gap_s) > definition.max_gap_s) return kUnknown;
  return (now.mean - before.mean) / (definition.length_s + now.mean_time_s - before.mean_time_s);
}

double temperature_of(const SecondMean& second_mean) { return second_mean.temperature_degc; }

}  // namespace

FeatureExtractor::FeatureExtractor(FeatureDefinition definition)
    : definition_(std::move(definition)), places_(definition_.sensors.size(), SIZE_MAX) {
  reset();
}

void FeatureExtractor::reset() {
  history_.clear();
  body_degc_ = kUnknown;
  incomplete_ = INT64_MIN;
}

Window FeatureExtractor::push(const SecondMean& second_mean) {
  Window window = take(second_mean);
  measure(window);
  return window;
}

std::optional<Window> FeatureExtractor::push_unless_ready(const SecondMean& second_mean) {
  Window window = take(second_mean);
  const int history = history_s(definition_);
  if (window.warm_s == history && incomplete_ <= second_mean.second - history && definition_.length_s > 1) return {};
  measure(window);
  return window.state == WindowState::kReady ? std::nullopt : std::optional(std::move(window));
}

Window FeatureExtractor::take(const SecondMean& second_mean) {
  Window window;
  window.second_mean = second_mean;
  window.sensors.resize(definition_.sensors.size());
  if (known_list_ != second_mean.sensor_list) use_sensor_list(second_mean);
  SecondMean taken = without_implausible(second_mean);
  respond(taken, window);
  admit(taken, window);
  const std::int64_t warm_s = second_mean.second - warm_since_ + 1;
  window.warm_s = static_cast<int>(std::min<std::int64_t>(warm_s, history_s(definition_)));
  return window;
}

// If the positions of the sensors in the new list differ, the history does not fit it and is cleared.
void FeatureExtractor::use_sensor_list(const SecondMean& second_mean) {
  const std::vector<SensorName>& list = sensors_of_list(second_mean.sensor_list);
  std::vector<std::size_t> places;
  for (const SensorName& sensor : definition_.sensors) places.push_back(sensor_index(list, sensor.name));
  if (places != places_) history_.clear();
  places_ = std::move(places);
  known_list_ = second_mean.sensor_list;
}

double FeatureExtractor::quantity(const SecondMean& second_mean, std::size_t sensor) const {
  const std::size_t place = places_[sensor];
  return place < second_mean.sensors.size() ? second_mean.sensors[place] : kUnknown;
}

// The exact response to a temperature that is constant since the second before.
void FeatureExtractor::respond(SecondMean& second_mean, Window& window) {
  const int tau_s = definition_.response_s;
  double& degc = second_mean.temperature_degc;
  if (tau_s == 0 || !std::isfinite(degc)) return;
  const std::int64_t now = second_mean.second;
  const double step = static_cast<double>(now - body_last_);
  if (std::isnan(body_degc_) || step <= 0 || step > std::max(definition_.max_gap_s + 1, tau_s / 10)) {
    body_degc_ = degc;
    body_since_ = now;
  } else {
    body_degc_ += (body_degc_ - degc) * std::expm1(-step / tau_s);
  }
  body_last_ = now;
  degc = body_degc_;
  window.settling = now - body_since_ < 3 * static_cast<std::int64_t>(tau_s);
}

// Keeps exactly the seconds that a full window needs; a gap above max_gap_s clears the history first.
void FeatureExtractor::admit(const SecondMean& second_mean, Window& window) {
  if (!history_.empty()) {
    const std::int64_t step = second_mean.second - history_.back().second;
    window.gap_s = static_cast<int>(std::clamp<std::int64_t>(step - 1, 0, 1'000'000'000));
    if (step <= 0 || window.gap_s > definition_.max_gap_s) history_.clear();
  }
  if (history_.empty()) warm_since_ = second_mean.second;
  // Sums of values below the limit are finite.
  const auto known = [](double value) { return std::fabs(value) < 1e100; };
  if (window.gap_s > 0 || !known(second_mean.rate_deg_per_h) || !known(second_mean.temperature_degc))
    incomplete_ = second_mean.second;
  history_.push_back(second_mean);
  while (history_.front().second <= second_mean.second - history_s(definition_)) history_.pop_front();
}

// Means over the available seconds, for models that need no slope; the slope and "ready" need the full window.
void FeatureExtractor::measure(Window& window) const {
  const std::int64_t last = window.second_mean.second;
  const std::int64_t first = std::max(last - definition_.length_s + 1, warm_since_);
  const auto fresh_mean = [&](auto value_of) {
    const MeanValue values = mean_value(history_, value_of, first, last);
    return values.longest_gap_s > definition_.max_gap_s ? kUnknown : values.mean;
  };
  window.rate_deg_per_h =
      mean_value(
          history_, [](const SecondMean& second_mean) { return second_mean.rate_deg_per_h; }, first, last)
          .mean;
  window.temperature_degc = fresh_mean(temperature_of);
  window.uhfo_v = fresh_mean([](const SecondMean& second_mean) { return second_mean.uhfo_v; });
  for (std::size_t i = 0; i < window.sensors.size(); ++i)
    window.sensors[i].mean = fresh_mean([&](const SecondMean& second_mean) { return quantity(second_mean, i); });
  if (window.warm_s < history_s(definition_)) return;
  window.slope_degc_per_s = slope_of(history_, temperature_of, definition_, last);
  for (std::size_t i = 0; i < window.sensors.size(); ++i) {
    window.sensors[i].slope_per_s = slope_of(
        history_, [&](const SecondMean& second_mean) { return quantity(second_mean, i); }, definition_, last);
  }
  const bool known_all = std::isfinite(window.rate_deg_per_h) && std::isfinite(window.temperature_degc) &&
                         std::isfinite(window.slope_degc_per_s);
  if (known_all) window.state = WindowState::kReady;
}

}  // namespace prism::compensation
