// SPDX-License-Identifier: MIT
#include "compensation/training/response.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "compensation/training/composite.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kMostSamples = 200;

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
  constexpr double kClear = 4;  // of the log likelihood: a careless time constant costs more than it can gain
  // Without U, chance finds time constants of a thermometer in the body: they gain little, and are known worse than
  // within this factor.
  constexpr double kCertain = 8, kFactor = 2;
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
  std::map<double, double> loss;  // minus the log likelihood, by the logarithm of the time constant
  const auto loss_at = [&](double tau_s) {
    const TrainingData means = averaged(tau_s > 0 ? responded(data, tau_s, length_s) : data);
    const auto normal = normalise(means, settings.scaling);
    if (!normal) return std::numeric_limits<double>::infinity();
    const CompositeSamples samples{normal->x, normal->y, means.time_s / 3600, means.runs, fold_count(means.runs), 0};
    return likely_theta(samples, drift_prior(settings.drift), settings).objective;
  };
  const double none = loss_at(0);
  const auto search = [&](double log_tau) { loss[log_tau] = loss_at(std::exp(log_tau)); };
  const auto best = [&] {
    return std::min_element(loss.begin(), loss.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
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
  const ResponseSearch as_measured{0, 0, 0, none - at->second};
  if (!std::isfinite(as_measured.gain)) return {};
  if (as_measured.gain <= kClear) return as_measured;
  // The parabola through the best and its neighbours.
  double peak = at->first;
  const bool is_longest = std::next(at) == loss.end();
  if (at != loss.begin() && !is_longest) {
    const auto [a, fa] = *std::prev(at);
    const auto [b, fb] = *at;
    const auto [c, fc] = *std::next(at);
    const double up = (fc - fb) / (c - b), down = (fb - fa) / (b - a), bend = (up - down) / (c - a);
    if (bend > 0) peak = std::clamp((a + b) / 2 - down / (2 * bend), a, c);
  }
  const auto crossing = [&](auto from, auto to, double edge) {
    for (auto before = from; from != to; before = from, ++from) {
      const double limit = at->second + kWithin;
      if (from->second > limit)
        return before->first +
               (from->first - before->first) * (limit - before->second) / (from->second - before->second);
    }
    return edge;
  };
  const double low_s = std::exp(crossing(std::make_reverse_iterator(std::next(at)), loss.rend(), first));
  if (as_measured.gain <= kCertain && (is_longest || kFactor * low_s < std::exp(peak))) return as_measured;
  return ResponseSearch{static_cast<int>(std::lround(std::exp(peak))), low_s, std::exp(crossing(at, loss.end(), last)),
                        as_measured.gain};
}

}  // namespace prism::training
