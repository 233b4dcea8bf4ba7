// SPDX-License-Identifier: MIT
#include "compensation/training/response.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "compensation/training/composite.hpp"
#include "compensation/training/held_out.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kMostSamples = 200;

/// A time constant: minus the log likelihood, and the sum of squares of the held-out errors.
struct Tried {
  double loss = std::numeric_limits<double>::infinity(), held_out = loss;
};

/// The samples as if the temperature had passed a first-order response, steady at the start of each run and after gaps.
TrainingData responded(const TrainingData& data, double tau_s, double length_s) {
  TrainingData result = data;
  const auto row_of = [&](const char* name) {
    return std::find(data.names.begin(), data.names.end(), name) - data.names.begin();
  };
  const Eigen::Index t = row_of(compensation::kInputTemperature), slope = row_of(compensation::kInputSlope);
  double body = 0;
  for (Eigen::Index k = 0; k < data.target.size(); ++k) {
    const double now = data.inputs(t, k), step = k > 0 ? data.time_s[k] - data.time_s[k - 1] : 0;
    const bool begins = k == 0 || data.runs[static_cast<std::size_t>(k)] != data.runs[static_cast<std::size_t>(k - 1)];
    if (begins || step <= 0 || step - length_s > tau_s) {
      body = now;
    } else {  // exact for a temperature that is linear between the middles of the blocks
      const double before = data.inputs(t, k - 1), behind = tau_s * (now - before) / step;
      body = now - behind + (body - before + behind) * std::exp(-step / tau_s);
    }
    result.inputs(t, k) = body;
    if (slope < data.inputs.rows()) result.inputs(slope, k) = (now - body) / tau_s;
  }
  return result;
}

/// Means of neighbouring samples of a run. A single sample would keep all of its noise.
TrainingData averaged(const TrainingData& data) {
  const Eigen::Index n = data.target.size(), group = (n + kMostSamples - 1) / kMostSamples;
  TrainingData result{data.names, Eigen::MatrixXd(data.inputs.rows(), n), Eigen::VectorXd(n), {}, Eigen::VectorXd(n)};
  Eigen::Index count = 0;
  for (Eigen::Index begin = 0, end = 0; begin < n; begin = end, ++count) {
    const int run = data.runs[static_cast<std::size_t>(begin)];
    while (end < n && end < begin + group && data.runs[static_cast<std::size_t>(end)] == run) ++end;
    result.inputs.col(count) = data.inputs.middleCols(begin, end - begin).rowwise().mean();
    result.target[count] = data.target.segment(begin, end - begin).mean();
    result.time_s[count] = data.time_s.segment(begin, end - begin).mean();
    result.runs.push_back(run);
  }
  result.inputs.conservativeResize(Eigen::NoChange, count);
  result.target.conservativeResize(count);
  result.time_s.conservativeResize(count);
  return result;
}

TrainingData without_suspects(const TrainingData& data, const TrainingSettings& settings) {
  const Eigen::VectorXd weight = first_weights(data, settings);
  Rows kept;
  for (Eigen::Index k = 0; k < weight.size(); ++k) {
    if (weight[k] >= kBelievedWeight) kept.push_back(k);
  }
  return {data.names, data.inputs(Eigen::all, kept), data.target(kept), numbered(taken(runs_of(data), kept)),
          3600 * time_of(data)(kept)};
}

}  // namespace

std::optional<ResponseSearch> find_response(const TrainingData& raw, const TrainingSettings& settings,
                                            double length_s) {
  constexpr double kShortest_s = 150, kLongest_s = 4 * 3600;
  // Of the log likelihood of all samples and that of held-out blocks, two values each, a level and a slope: a body of
  // hours gains little and predicts far better; of a thermometer in it, without U, a likely one by chance does not.
  constexpr double kClear = 6;
  constexpr int kBlocks = 5;        // held out; in shorter ones, neighbours show the drift
  constexpr double kWithin = 1.92;  // half of the 95 % quantile of chi-square, one degree of freedom
  constexpr Eigen::Index kFewestRows = 50;
  constexpr double kLeast_s = 8 * 3600;  // in less, a drift looks like a slow response (docs/decisions/training.md)
  const auto depends_on_t = [](const std::string& name) {  // otherwise than T and dTdt
    return name.starts_with("T-") || name.ends_with("-T");
  };
  const auto has = [&](const char* name) { return std::count(raw.names.begin(), raw.names.end(), name) > 0; };
  // Without dTdt, a response would stand for the slope that the model lacks.
  if (!has(compensation::kInputTemperature) || !has(compensation::kInputSlope) ||
      std::any_of(raw.names.begin(), raw.names.end(), depends_on_t) || raw.target.size() < kFewestRows ||
      static_cast<double>(raw.target.size()) * length_s < kLeast_s || one_passage(raw))
    return {};
  const TrainingData data = without_suspects(raw, settings);
  const auto tried_at = [&](double tau_s) {
    const TrainingData means = averaged(tau_s > 0 ? responded(data, tau_s, length_s) : data);
    const auto normal = normalise(means, settings.scaling);
    if (!normal) return Tried{};
    const CompositeSamples samples{normal->x, normal->y, means.time_s / 3600, means.runs, fold_count(means.runs), 0};
    const CompositeFit fit = likely_theta(samples, drift_prior(settings.drift), settings);
    const Eigen::VectorXd error =
        held_out(blocked_folds(means.runs, kBlocks), [&](const Rows& rest, const Rows& members) {
          const CompositeSamples part = samples.part(rest);  // the system refers to it
          const auto system = CompositeSystem::make(part, fit.theta, fit.weight(rest));
          return system ? Eigen::VectorXd(samples.y(members) - system->predict(samples.x(Eigen::all, members)))
                        : Eigen::VectorXd();
        });
    return Tried{fit.objective, error.size() > 0 ? error.squaredNorm() : Tried{}.held_out};
  };
  const Tried none = tried_at(0);
  std::map<double, Tried> tried;  // by the logarithm of the time constant
  const auto search = [&](double log_tau) { tried[log_tau] = tried_at(std::exp(log_tau)); };
  const auto best = [&] {
    return std::min_element(tried.begin(), tried.end(),
                            [](const auto& a, const auto& b) { return a.second.loss < b.second.loss; });
  };
  const double first = std::log(kShortest_s), last = std::log(kLongest_s);
  double step = (last - first) / 6;
  for (int k = 0; k <= 6 && !settings.stopped(); ++k) search(first + k * step);
  for (int halvings = 0; halvings < 2 && !settings.stopped(); ++halvings) {
    step /= 2;
    const double middle = best()->first;
    for (const double log_tau : {middle - step, middle + step}) {
      if (log_tau > first - step && log_tau < last) search(log_tau);
    }
  }
  if (settings.stopped()) return {};
  const auto at = best();
  const double gain = none.loss - at->second.loss, limit = at->second.loss + kWithin;
  if (!std::isfinite(gain)) return {};
  const double predicted = kBlocks * std::log(none.held_out / at->second.held_out);
  if (!(gain + predicted > kClear)) return ResponseSearch{0, 0, 0, gain};
  // The parabola through the best and its neighbours.
  double peak = at->first;
  if (at != tried.begin() && std::next(at) != tried.end()) {
    const double a = std::prev(at)->first, b = at->first, c = std::next(at)->first, fb = at->second.loss;
    const double up = (std::next(at)->second.loss - fb) / (c - b), down = (fb - std::prev(at)->second.loss) / (b - a);
    const double bend = (up - down) / (c - a);
    if (bend > 0) peak = std::clamp((a + b) / 2 - down / (2 * bend), a, c);
  }
  const auto crossing_s = [&](auto from, auto to, double edge) {
    for (auto before = from; from != to; before = from, ++from) {
      const double loss = before->second.loss;
      if (from->second.loss > limit)
        return std::exp(before->first + (from->first - before->first) * (limit - loss) / (from->second.loss - loss));
    }
    return std::exp(edge);
  };
  const double low_s = crossing_s(std::make_reverse_iterator(std::next(at)), tried.rend(), first);
  return ResponseSearch{static_cast<int>(std::lround(std::exp(peak))), low_s, crossing_s(at, tried.end(), last), gain};
}

}  // namespace prism::training
