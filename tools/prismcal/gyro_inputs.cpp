// SPDX-License-Identifier: MIT
#include "tools/prismcal/gyro_inputs.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "tools/prismsim/simulation/random_source.hpp"

namespace prism::design {
namespace {

constexpr double kSlowTime_s = 4 * 3600;  // of the heat deep in the gyro, which other inputs follow
constexpr double kStep_s = 10;
constexpr std::uint64_t kSeed = 1;

Eigen::Index place_of(const std::vector<std::string>& names, const std::string& name) {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : at - names.begin();
}

bool follows_from_temperature(const std::string& name) {
  return name == compensation::kInputTemperature || name == compensation::kInputSlope;
}

// T minus its exponential mean over kSlowTime_s, at each row.
Eigen::VectorXd slow_part(const Eigen::VectorXd& t, const Eigen::VectorXd& time_h) {
  Eigen::VectorXd slow(t.size());
  double mean = t[0];
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    if (i > 0) mean -= (t[i] - mean) * std::expm1(-(time_h[i] - time_h[i - 1]) * 3600 / kSlowTime_s);
    slow[i] = t[i] - mean;
  }
  return slow;
}

// Halton's sequence in the i-th prime base: an even cover of the unit cube.
double halton(int index, std::size_t dimension) {
  constexpr int kPrimes[] = {2, 3, 5, 7, 11, 13, 17, 19, 23, 29};
  const int base = kPrimes[dimension % std::size(kPrimes)];
  double value = 0, share = 1;
  for (; index > 0; index /= base) {
    share /= base;
    value += share * (index % base);
  }
  return value;
}

}  // namespace

void append_columns(Eigen::MatrixXd& all, const Eigen::MatrixXd& more) {
  const Eigen::Index before = all.cols();
  all.conservativeResize(more.rows(), before + more.cols());
  all.rightCols(more.cols()) = more;
}

Result<GyroInputs> GyroInputs::make(std::vector<std::string> names, const compensation::FeatureDefinition& features,
                                    const ThermalResponse& response, const std::vector<RecordedInputs>& recorded) {
  GyroInputs made;
  made.names_ = std::move(names);
  made.features_ = features;
  made.response_ = response;
  made.lines_.resize(made.names_.size());
  const Eigen::Index t = place_of(made.names_, compensation::kInputTemperature),
                     slope = place_of(made.names_, compensation::kInputSlope);
  if (t < 0) return make_error("inputs", fmt::format("found {}, expected T among them", fmt::join(made.names_, ", ")));
  for (std::size_t j = 0; j < made.names_.size(); ++j) {
    if (follows_from_temperature(made.names_[j])) continue;
    if (recorded.empty())
      return make_error("inputs", fmt::format("{} does not follow from the chamber's temperature: design needs a model "
                                              "with its recordings, or --prior",
                                              made.names_[j]));
    Eigen::Index rows = 0;
    for (const RecordedInputs& r : recorded) rows += r.inputs.cols();
    Eigen::MatrixX4d terms(rows, 4);
    Eigen::VectorXd value(rows);
    Eigen::Index at = 0;
    for (const RecordedInputs& r : recorded) {
      const Eigen::Index n = r.inputs.cols();
      const Eigen::VectorXd temperature = r.inputs.row(t);
      auto part = terms.middleRows(at, n);
      part.col(0).setOnes();
      part.col(1) = temperature;
      part.col(2).setZero();
      if (slope >= 0) part.col(2) = r.inputs.row(slope).transpose();
      part.col(3) = slow_part(temperature, r.time_h);
      value.segment(at, n) = r.inputs.row(static_cast<Eigen::Index>(j)).transpose();
      at += n;
    }
    Line& line = made.lines_[j];
    line.slope = terms.completeOrthogonalDecomposition().solve(value);
    const Eigen::VectorXd left = value - terms * line.slope;
    line.sd = std::sqrt(left.squaredNorm() / static_cast<double>(rows));
    if (line.sd > 0)
      line.kept = std::clamp(left.head(rows - 1).dot(left.tail(rows - 1)) / left.squaredNorm(), 0.0, 0.999);
  }
  return made;
}

Eigen::VectorXd GyroInputs::row(double t_degc, double slope_degc_per_s, double slow_degc,
                                const std::vector<double>& noise) const {
  Eigen::VectorXd x(static_cast<Eigen::Index>(names_.size()));
  for (std::size_t j = 0; j < names_.size(); ++j) {
    double& value = x[static_cast<Eigen::Index>(j)];
    if (names_[j] == compensation::kInputTemperature) {
      value = t_degc;
    } else if (names_[j] == compensation::kInputSlope) {
      value = slope_degc_per_s;
    } else {
      value = lines_[j].slope.dot(Eigen::Vector4d(1, t_degc, slope_degc_per_s, slow_degc)) + lines_[j].sd * noise[j];
    }
  }
  return x;
}

RecordedInputs GyroInputs::on(const simulation::ChamberProfile& profile, int windows) const {
  const double window_s = features_.length_s, row_s = window_s * windows;
  const double share = response_.lag_s > 0 ? -std::expm1(-kStep_s / response_.lag_s) : 1;
  double body = profile.start_degc + (response_.lag_s > 0 ? 0 : response_.self_heating_degc), slow = body;
  std::vector<double> before{body};  // temperatures of the last window
  std::vector<simulation::RandomSource> random;
  std::vector<double> noise;
  for (std::size_t j = 0; j < names_.size(); ++j) noise.push_back(random.emplace_back(kSeed, j).normal());
  RecordedInputs recorded;
  std::vector<Eigen::VectorXd> rows;
  std::vector<double> time_h;
  double next_s = row_s;
  const auto back = static_cast<std::size_t>(std::max(1.0, std::round(window_s / kStep_s)));
  for (double time_s = kStep_s; time_s <= profile.duration_s() + 1e-6; time_s += kStep_s) {
    body += (profile.temperature_degc(time_s - kStep_s / 2) + response_.self_heating_degc - body) * share;
    slow -= (body - slow) * std::expm1(-kStep_s / kSlowTime_s);
    before.push_back(body);
    if (time_s + 1e-6 < next_s) continue;
    next_s += row_s;
    const std::size_t count = std::min(back, before.size() - 1);
    const double from = before[before.size() - 1 - count];
    for (std::size_t j = 0; j < noise.size(); ++j) {
      const double kept = std::pow(lines_[j].kept, windows);
      noise[j] = kept * noise[j] + std::sqrt(1 - kept * kept) * random[j].normal();
    }
    rows.push_back(row((body + from) / 2, (body - from) / (static_cast<double>(count) * kStep_s), body - slow, noise));
    time_h.push_back(time_s / 3600);
  }
  recorded.inputs.resize(static_cast<Eigen::Index>(names_.size()), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) recorded.inputs.col(static_cast<Eigen::Index>(i)) = rows[i];
  recorded.time_h = Eigen::Map<const Eigen::VectorXd>(time_h.data(), static_cast<Eigen::Index>(time_h.size()));
  return recorded;
}

Result<Eigen::MatrixXd> GyroInputs::over(const std::vector<InputRange>& domain, int count) const {
  for (const InputRange& range : domain) {
    if (place_of(names_, range.input) < 0)
      return make_error(
          "--domain", fmt::format("found {}, expected inputs of the model: {}", range.input, fmt::join(names_, ", ")));
  }
  const auto range_of = [&](const char* name) {
    return std::find_if(domain.begin(), domain.end(), [&](const InputRange& r) { return r.input == name; });
  };
  const auto t = range_of(compensation::kInputTemperature), slope = range_of(compensation::kInputSlope);
  if (t == domain.end()) return make_error("--domain", "found no range of T, expected one");
  Eigen::MatrixXd points(static_cast<Eigen::Index>(names_.size()), count);
  simulation::RandomSource random(kSeed, names_.size());
  for (int i = 0; i < count; ++i) {
    const auto within = [&](const InputRange& r) {
      return r.low + (r.high - r.low) * halton(i + 1, static_cast<std::size_t>(place_of(names_, r.input)));
    };
    std::vector<double> noise(names_.size());
    for (double& value : noise) value = random.normal();
    points.col(i) = row(within(*t), slope == domain.end() ? 0 : within(*slope), 0, noise);
    for (const InputRange& range : domain) points(place_of(names_, range.input), i) = within(range);
  }
  return points;
}

}  // namespace prism::design
