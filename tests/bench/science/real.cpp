// SPDX-License-Identifier: MIT
// Splits of a real recording: trained on one part, evaluated on the rest, by the rms relative to the training mean.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "compensation/evaluation/statistics.hpp"
#include "tests/bench/science/contenders.hpp"
#include "tests/bench/science/record.hpp"
#include "tests/bench/science/tables.hpp"

namespace prism::science {
namespace {

constexpr int kJudgedWindow_s = 30;
constexpr std::string_view kJudgedSplits = "branches";

using Rows = std::pair<Eigen::Index, Eigen::Index>;  // [begin, end)

struct Split {
  std::string name;
  Rows train;
  std::vector<Rows> tests;
};

// At the temperature extremes: the coldest row, then the hottest one after it.
std::vector<Split> branches(const training::TrainingData& data) {
  const Eigen::Index n = data.target.size();
  Eigen::Index cold = 0, hot = 0;
  data.inputs.row(0).minCoeff(&cold);
  data.inputs.row(0).tail(n - cold).maxCoeff(&hot);
  hot += cold;
  return {{"first cooling → warming", {0, cold}, {{cold, hot}}},
          {"warming → all cooling", {cold, hot}, {{0, cold}, {hot, n}}},
          {"first half → second half", {0, n / 2}, {{n / 2, n}}},
          {"second half → first half", {n / 2, n}, {{0, n / 2}}},
          {"warming and second cooling → first cooling", {cold, n}, {{0, cold}}},
          {"first cooling and warming → second cooling", {0, hot}, {{hot, n}}}};
}

std::vector<Split> thirds(const training::TrainingData& data) {
  const Eigen::Index n = data.target.size(), a = n / 3, b = 2 * n / 3;
  return {{"first third → rest", {0, a}, {{a, n}}},
          {"middle third → rest", {a, b}, {{0, a}, {b, n}}},
          {"last third → rest", {b, n}, {{0, b}}},
          {"first two → last", {0, b}, {{b, n}}},
          {"last two → first", {a, n}, {{0, a}}}};
}

struct Judged {
  double improvement = 0;  // relative to the rms about the training mean
  double covered = 0;      // within 2 sd_mean
};

Judged judge(const compensation::Model& model, compensation::Extrapolation policy, const training::TrainingData& data,
             const Split& split, double level) {
  double before = 0, after = 0, inside = 0, count = 0;
  for (const auto& [begin, end] : split.tests) {
    const training::TrainingData test = rows(data, begin, end);
    const Served served = serve(model, test, policy);
    before += (test.target.array() - level).square().sum();
    after += (test.target - served.bias).squaredNorm();
    inside += covered(test.target - served.bias, served.sd_mean) * static_cast<double>(end - begin);
    count += static_cast<double>(end - begin);
  }
  return {1 - std::sqrt(after / before), inside / count};
}

// A line of the table; the composite kernel's improvement with the default policy.
double print_split(int window_s, const char* axis, const training::TrainingData& data, const Split& split) {
  const training::TrainingData training = rows(data, split.train.first, split.train.second);
  const double level = training.target.mean();
  const compensation::ModelPtr ours = trained(kContenders.front(), training);
  const Judged served = judge(*ours, kContenders.front().policy, data, split, level),
               plain = judge(*ours, compensation::Extrapolation::kFlag, data, split, level);
  const Eigen::VectorXd x = training.inputs.col(0);
  const double skill = ours->predict({x.data(), static_cast<std::size_t>(x.size())}).knowledge->skill;
  fmt::print("| {} | {} | {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.1f} |", window_s, axis, split.name,
             training.target.size(), skill, 100 * served.improvement, 100 * served.covered, 100 * plain.improvement);
  for (std::size_t i = 1; i < kContenders.size(); ++i) {
    const Judged rival = judge(*trained(kContenders[i], training), kContenders[i].policy, data, split, level);
    fmt::print(" {:.1f} |", 100 * rival.improvement);
  }
  fmt::print("\n");
  std::fflush(stdout);
  return served.improvement;
}

void print_summary(int window_s, const char* kind, std::vector<double> all) {
  std::sort(all.begin(), all.end());
  const auto below = [&](double limit) { return std::lower_bound(all.begin(), all.end(), limit) - all.begin(); };
  double clipped = 0;
  for (const double improvement : all) clipped += std::max(improvement, -1.0) / static_cast<double>(all.size());
  fmt::print(
      "<!-- {} s, {}: {} splits, mean {:.1f} % (each at least -100), worst {:.1f} %, {} below -5 %, {} below -25 %, "
      "median {:.1f} % -->\n",
      window_s, kind, all.size(), 100 * clipped, 100 * all.front(), below(-0.05), below(-0.25),
      100 * evaluation::median_of(all));
  if (window_s != kJudgedWindow_s || std::string_view(kind) != kJudgedSplits) return;
  bar("chamber splits, mean", fmt::format("{:.1f} %", 100 * clipped), "26 %", clipped >= 0.26);
  bar("chamber splits below -5 %", fmt::format("{}", below(-0.05)), "at most 1", below(-0.05) <= 1);
  bar("chamber splits, the worst", fmt::format("{:.1f} %", 100 * all.front()), "-12 %", all.front() >= -0.12);
}

}  // namespace

int real(const std::string& path) {
  fmt::print("| window, s | axis | split | rows | skill | composite | within 2 sd_mean, % | unshrunk |");
  for (std::size_t i = 1; i < kContenders.size(); ++i) fmt::print(" {} |", kContenders[i].name);
  fmt::print("\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& [kind, splits_of] : {std::pair{"branches", &branches}, std::pair{"thirds", &thirds}}) {
    for (const int window_s : {30, 15, 60}) {
      std::vector<double> all;
      for (const char* axis : {"x", "y", "z"}) {
        const auto data = chamber_recording(path, axis, window_s);
        if (!data) {
          fmt::print(stderr, "{}\n", data.error().text());
          return 1;
        }
        for (const Split& split : splits_of(*data)) all.push_back(print_split(window_s, axis, *data, split));
      }
      print_summary(window_s, kind, std::move(all));
    }
  }
  return 0;
}

}  // namespace prism::science
