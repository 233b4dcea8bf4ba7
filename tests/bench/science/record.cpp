// SPDX-License-Identifier: MIT
#include "tests/bench/science/record.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>

#include "compensation/features.hpp"
#include "compensation/second_averager.hpp"

namespace prism::science {
namespace {

// Windows that end a block, in order of time.
class Blocks {
 public:
  Blocks(compensation::FeatureDefinition features, std::vector<std::string> inputs) : extractor_(std::move(features)) {
    data_.names = std::move(inputs);
  }
  /// Returns true if this second ended a block.
  bool push(const compensation::SecondMean& second_mean) {
    if (second_mean.second < next_) return extractor_.push_unless_ready(second_mean), false;
    const compensation::Window window = extractor_.push(second_mean);
    if (window.state != compensation::WindowState::kReady) return false;
    next_ = second_mean.second + extractor_.definition().length_s;
    std::vector<double> row;
    for (const std::string& name : data_.names)
      row.push_back(compensation::input_value(window, extractor_.definition(), name));
    inputs_.push_back(std::move(row));
    target_.push_back(window.rate_deg_per_h);
    time_s_.push_back(static_cast<double>(second_mean.second));
    return true;
  }
  training::TrainingData finish() {
    const auto n = static_cast<Eigen::Index>(target_.size());
    data_.inputs.resize(static_cast<Eigen::Index>(data_.names.size()), n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto& row = inputs_[static_cast<std::size_t>(i)];
      data_.inputs.col(i) = Eigen::Map<const Eigen::VectorXd>(row.data(), data_.inputs.rows());
    }
    data_.target = Eigen::Map<const Eigen::VectorXd>(target_.data(), n);
    data_.time_s = Eigen::Map<const Eigen::VectorXd>(time_s_.data(), n);
    data_.runs.assign(target_.size(), 0);
    return data_;
  }

 private:
  compensation::FeatureExtractor extractor_;
  training::TrainingData data_;
  std::vector<std::vector<double>> inputs_;
  std::vector<double> target_, time_s_;
  std::int64_t next_ = 0;
};

}  // namespace

compensation::SecondMean measured(const simulation::GyroTruth& now, std::int64_t second, double bias_deg_per_h,
                                  simulation::RandomSource& noise) {
  compensation::SecondMean mean;
  mean.second = second;
  mean.samples = 1;
  mean.rate_deg_per_h = bias_deg_per_h + simulation::kRateNoise_deg_per_h_sqrt_s * noise.normal();
  mean.temperature_degc = now.sensor_degc;
  mean.uhfo_v = now.uhfo_v;
  return mean;
}

Record simulate(const simulation::ChamberProfile& profile, const simulation::BiasModelSettings& truth,
                std::uint64_t seed, std::uint64_t individual) {
  simulation::SimulatedGyro gyro(profile, seed, truth);
  simulation::RandomSource character(individual, 2);
  const double scale = individual ? 0.2 * character.normal() : 0, bend = individual ? 0.004 * character.normal() : 0;
  simulation::RandomSource noise(seed, 1);
  Blocks blocks(compensation::FeatureDefinition{},
                {compensation::kInputTemperature, compensation::kInputSlope, compensation::kInputUhfo});
  Record record;
  std::vector<double> thermal, repeating;
  double bias = 0;
  int seconds = 0;
  const auto end = static_cast<std::int64_t>(profile.duration_s());
  for (std::int64_t second = 0; second < end; ++second) {
    const simulation::GyroTruth& now = gyro.step(1);
    const double true_bias =
        now.bias_deg_per_h + scale * now.causes.thermal + bend * std::tanh((now.body_degc - 10) / 25);
    bias += true_bias;
    ++seconds;
    const bool whole = seconds >= 100;
    if (!blocks.push(measured(now, second, true_bias, noise))) continue;
    thermal.push_back(now.causes.thermal);
    repeating.push_back(now.causes.thermal + now.causes.hysteresis);
    if (whole) record.true_bias_deg_per_h.push_back(bias / seconds);
    bias = 0;
    seconds = 0;
  }
  record.data = blocks.finish();
  record.thermal_deg_per_h =
      Eigen::Map<const Eigen::VectorXd>(thermal.data(), static_cast<Eigen::Index>(thermal.size()));
  record.repeating_deg_per_h =
      Eigen::Map<const Eigen::VectorXd>(repeating.data(), static_cast<Eigen::Index>(repeating.size()));
  record.true_bias_deg_per_h.resize(static_cast<std::size_t>(record.data.target.size()), kUnknown);
  return record;
}

Cycle simulate_cycle(const simulation::ChamberProfile& profile, const simulation::BiasModelSettings& truth,
                     std::uint64_t seed) {
  simulation::SimulatedGyro gyro(profile, seed, truth);
  simulation::RandomSource noise(seed, 1);
  Cycle cycle;
  const auto end = static_cast<std::int64_t>(profile.duration_s());
  for (std::int64_t second = 0; second < end; ++second) {
    const simulation::GyroTruth& now = gyro.step(1);
    cycle.seconds.push_back(measured(now, second, now.bias_deg_per_h, noise));
  }
  return cycle;
}

training::TrainingData Cycle::blocks(int tau_s) const {
  compensation::FeatureDefinition features;
  features.response_s = tau_s;
  Blocks made(features, {compensation::kInputTemperature, compensation::kInputSlope, compensation::kInputUhfo});
  for (const compensation::SecondMean& mean : seconds) made.push(mean);
  return made.finish();
}

training::TrainingData rows(const training::TrainingData& data, Eigen::Index begin, Eigen::Index end) {
  const Eigen::Index n = end - begin;
  training::TrainingData part{
      data.names, data.inputs.middleCols(begin, n), data.target.segment(begin, n), {}, data.time_s.segment(begin, n)};
  part.runs.assign(static_cast<std::size_t>(n), 0);
  return part;
}

Result<training::TrainingData> chamber_recording(const std::string& path, const std::string& axis, int window_s) {
  std::ifstream in(path);
  if (!in) return make_error(path, "cannot read it; expected the chamber recording in ../shared/data");
  std::string line, field;
  std::getline(in, line);
  std::getline(in, line);  // the first row is a start-up outlier
  const std::size_t column = axis == "x" ? 2 : axis == "y" ? 3 : 4;
  compensation::FeatureDefinition features;
  features.length_s = window_s;
  Blocks blocks(features, {compensation::kInputTemperature, compensation::kInputSlope});
  compensation::SecondAverager averager;
  double before_s = 0;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    std::vector<double> values;
    while (std::getline(row, field, ',')) values.push_back(std::strtod(field.c_str(), nullptr));
    if (values.size() <= column) return make_error(path, "found a row that is too short: " + line);
    Sample sample;
    sample.time_ns = std::llround(values[0] * 1e9);
    sample.interval_s = values[0] - before_s;
    sample.rate_deg_per_h = values[column] * 3600;
    sample.temperature_degc = values[1];
    before_s = values[0];
    if (const auto second_mean = averager.push(sample)) blocks.push(*second_mean);
  }
  if (const auto second_mean = averager.finish()) blocks.push(*second_mean);
  return blocks.finish();
}

training::TrainingData joined(const std::vector<training::TrainingData>& recordings, bool one_run) {
  Eigen::Index n = 0;
  for (const training::TrainingData& r : recordings) n += r.target.size();
  const training::TrainingData& first = recordings.front();
  training::TrainingData all{
      first.names, Eigen::MatrixXd(first.inputs.rows(), n), Eigen::VectorXd(n), {}, Eigen::VectorXd(n)};
  Eigen::Index at = 0;
  double begin_s = 0;
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    const training::TrainingData& r = recordings[k];
    const Eigen::Index m = r.target.size();
    all.inputs.middleCols(at, m) = r.inputs;
    all.target.segment(at, m) = r.target;
    all.time_s.segment(at, m) = r.time_s.array() + begin_s;
    all.runs.insert(all.runs.end(), static_cast<std::size_t>(m), one_run ? 0 : static_cast<int>(k));
    at += m;
    if (one_run) begin_s += r.time_s[m - 1] + 100;
  }
  return all;
}

double improvement(const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
  return 1 - after.norm() / before.norm();
}

double gained(const training::TrainingData& test, const Eigen::VectorXd& prediction) {
  const Eigen::VectorXd error = test.target - prediction;
  return improvement(test.target.array() - test.target.mean(), error.array() - error.mean());
}

}  // namespace prism::science
