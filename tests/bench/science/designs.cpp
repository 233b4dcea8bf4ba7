// SPDX-License-Identifier: MIT
// The value of a first recording: eight hours of the designed profile, of simple ones, and the paper's
// cycle.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"
#include "tools/prismcal/plan.hpp"

namespace prism::science {
namespace {

constexpr int kSiblings = 2;
constexpr double kHours = 8;
constexpr const char* kDomain = "T=-30:70, dTdt=-0.5:0.5 degC/min";
constexpr design::ChamberLimits kChamber{-40, 70, 2, 25};

template <class T>
T checked(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "{}\n", result.error().text());
  std::exit(1);
}

/// One first recording, and its results on the third profile over the gyros.
struct Way {
  simulation::ChamberProfile profile;
  double predicted_deg_per_h = 0;  ///< sd on the third profile, before the recording is made
  std::vector<double> gain = {};
  double stated = 0, error = 0;  ///< mean squares: sd that the model states, true bias minus prediction

  void judge(const training::TrainingData& recording, const Record& test, int count) {
    const Served served = serve(*trained(kContenders.front(), recording), test.data, kContenders.front().policy);
    gain.push_back(gained(test.data, served.bias));
    const Eigen::Index rows = test.data.target.size() - 2;  // the truth of the first and last block is incomplete
    const Eigen::Map<const Eigen::VectorXd> truth(test.true_bias_deg_per_h.data(), rows + 2);
    stated += served.sd.segment(1, rows).squaredNorm() / static_cast<double>(rows * count);
    error += (truth - served.bias).segment(1, rows).squaredNorm() / static_cast<double>(rows * count);
  }
};

/// Sets the sd (root mean square) that models of these gyros will state on the third profile after each recording.
void predict_sd(const std::vector<design::KnownGyro>& gyros, std::vector<Way>& ways) {
  constexpr int kWindows = 3;  // in each row, except of the recording
  std::vector<design::RecordedInputs> shown;
  for (const design::KnownGyro& gyro : gyros) shown.insert(shown.end(), gyro.recordings.begin(), gyro.recordings.end());
  const auto inputs = checked(design::GyroInputs::make(gyros.front().inputs, gyros.front().features, {}, shown));
  const Eigen::MatrixXd used = inputs.on(simulation::third_profile(), kWindows).inputs;
  Eigen::MatrixXd reachable;
  for (const Way& way : ways) design::append_columns(reachable, inputs.on(way.profile, kWindows).inputs);
  std::vector<double> squares(ways.size());
  for (const design::KnownGyro& gyro : gyros) {
    const auto posterior = checked(design::DesignPosterior::make(gyro, used, reachable, kHours));
    for (std::size_t i = 0; i < ways.size(); ++i)
      squares[i] += std::pow(posterior.sd_with(inputs.on(ways[i].profile)), 2);
  }
  for (std::size_t i = 0; i < ways.size(); ++i)
    ways[i].predicted_deg_per_h = std::sqrt(squares[i] / static_cast<double>(gyros.size()));
}

/// The designed profile first, then the paper's cycle, then the simple ones.
std::vector<Way> ways_of(const std::vector<design::KnownGyro>& gyros) {
  design::PlanSettings settings;
  settings.chamber = kChamber;
  settings.domain = checked(design::parse_domain(kDomain));
  settings.hours = kHours;
  const design::Plan plan = checked(design::plan_recording(gyros, settings));
  std::vector<Way> ways = {{plan.profile}, {simulation::paper_profile()}};
  auto usual = design::usual_profiles(settings.chamber, kHours);
  for (std::size_t i = 1; i < usual.size(); ++i) ways.push_back({std::move(usual[i])});
  predict_sd(gyros, ways);
  return ways;
}

}  // namespace

int designs(std::uint64_t first_seed, int count) {
  fmt::print(
      "| truth | first recording | hours | improvement, % (worst) | sd predicted | sd stated | rms error, deg/h |\n"
      "| --- | --- | --- | --- | --- | --- | --- |\n");
  std::vector<double> improvement;  // by way, sum over the truths
  double predicted = 0, stated = 0, error = 0;
  for (const Truth& truth : truths()) {
    std::vector<design::KnownGyro> gyros;
    for (int i = 0; i < kSiblings; ++i) {
      const auto seed = first_seed + 900000 + static_cast<std::uint64_t>(i);
      gyros.push_back(checked(design::known_gyro(
          trained(kContenders.front(), simulate(simulation::paper_profile(), truth.settings, seed).data))));
    }
    std::vector<Way> ways = ways_of(gyros);
    for (int s = 0; s < count; ++s) {
      std::uint64_t seed = first_seed + 20 * static_cast<std::uint64_t>(s);
      const Record test = simulate(simulation::third_profile(), truth.settings, seed);
      for (Way& way : ways) way.judge(simulate(way.profile, truth.settings, ++seed).data, test, count);
    }
    improvement.resize(ways.size());
    for (std::size_t i = 0; i < ways.size(); ++i) {
      const Way& way = ways[i];
      improvement[i] += mean(way.gain);
      fmt::print("| {} | {} | {:.1f} | {:.1f} ({:.1f}) | {:.5f} | {:.5f} | {:.5f} |\n", truth.name, way.profile.name,
                 way.profile.duration_s() / 3600, 100 * mean(way.gain),
                 100 * *std::min_element(way.gain.begin(), way.gain.end()), way.predicted_deg_per_h,
                 std::sqrt(way.stated), std::sqrt(way.error));
    }
    predicted += std::pow(ways.front().predicted_deg_per_h, 2);
    stated += ways.front().stated;
    error += ways.front().error;
    std::fflush(stdout);
  }
  const double share = improvement[0] / improvement[1];
  bar("designed 8 h, of the paper's cycle", fmt::format("{:.0f} %", 100 * share), "85 %", share >= 0.85);
  const double simple = *std::max_element(improvement.begin() + 2, improvement.end());
  bar("designed 8 h, against the best of the simple profiles of 8 h",
      fmt::format("{:.1f} %", 100 * improvement[0] / static_cast<double>(truths().size())),
      fmt::format("more than {:.1f} %", 100 * simple / static_cast<double>(truths().size())), improvement[0] > simple);
  const auto near = [](double ratio) { return ratio >= 0.85 && ratio <= 1.15; };
  const double to_stated = std::sqrt(predicted / stated), to_error = std::sqrt(predicted / error);
  bar("sd predicted by design, over the sd that the model states", fmt::format("{:.2f}", to_stated), "0.85 to 1.15",
      near(to_stated));
  bar("sd predicted by design, over the rms error", fmt::format("{:.2f}", to_error), "0.85 to 1.15", near(to_error));
  return 0;
}

}  // namespace prism::science
