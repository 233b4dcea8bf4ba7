// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/lot_analysis.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "compensation/evaluation/statistics.hpp"

namespace prism::campaign {
namespace {

constexpr std::size_t kFewest = 8, kFewestBins = 4;

double at_share(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(below);
  return below + 1 < sorted.size() ? sorted[below] + part * (sorted[below + 1] - sorted[below]) : sorted.back();
}

/// One outcome a gyro: the curve is of its training recordings, whatever the model.
std::vector<const TaskResult*> with_curves(const std::vector<TaskResult>& outcomes) {
  std::vector<const TaskResult*> found;
  std::set<std::string> seen;
  for (const TaskResult& outcome : outcomes) {
    if (outcome.curve.size() >= kFewestBins && seen.insert(outcome.gyro).second) found.push_back(&outcome);
  }
  return found;
}

}  // namespace

std::optional<double> lot_value(const TaskResult& outcome, const std::string& quantity) {
  if (quantity == "mean_of_training_deg_per_h") return outcome.mean_deg_per_h;
  const RecordingResult* repeat = outcome.repeat();
  if (!repeat) return std::nullopt;
  return quantity == "before_deg_per_h" ? repeat->before_deg_per_h : repeat->value(quantity);
}

LotStatistics statistics_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values.size(),          values.front(), at_share(values, 0.05),       at_share(values, 0.5),
          at_share(values, 0.95), values.back(),  evaluation::robust_sd(values)};
}

std::vector<Outlier> find_outliers(const std::vector<TaskResult>& outcomes) {
  std::map<std::string, std::vector<const TaskResult*>> models;
  for (const TaskResult& outcome : outcomes) models[outcome.model].push_back(&outcome);
  std::vector<Outlier> outliers;
  for (const auto& [model, members] : models) {
    for (const LotQuantity& quantity : kLotQuantities) {
      std::vector<double> values;
      for (const TaskResult* outcome : members) {
        if (const auto value = lot_value(*outcome, quantity.name)) values.push_back(*value);
      }
      if (values.size() < kFewest) continue;
      const LotStatistics spread = statistics_of(values);
      if (!(spread.robust_sd > 0)) continue;
      for (const TaskResult* outcome : members) {
        const auto value = lot_value(*outcome, quantity.name);
        const double score = value ? (*value - spread.median) / spread.robust_sd : 0;
        if (std::abs(score) > kOutlierScore) outliers.push_back({outcome, quantity.name, *value, score});
      }
    }
  }
  std::stable_sort(outliers.begin(), outliers.end(),
                   [](const Outlier& a, const Outlier& b) { return std::abs(a.score) > std::abs(b.score); });
  return outliers;
}

std::optional<CurveSimilarity> compare_curves(const TaskResult& a, const TaskResult& b) {
  std::vector<std::pair<double, double>> both;
  for (auto x = a.curve.begin(), y = b.curve.begin(); x != a.curve.end() && y != b.curve.end();) {
    if (x->first < y->first) {
      ++x;
    } else if (y->first < x->first) {
      ++y;
    } else {
      both.emplace_back(x++->second, y++->second);
    }
  }
  if (both.size() < kFewestBins) return std::nullopt;
  double mean_x = 0, mean_y = 0, xx = 0, yy = 0, xy = 0;
  for (const auto& [x, y] : both) mean_x += x, mean_y += y;
  const auto n = static_cast<double>(both.size());
  for (const auto& [x, y] : both) {
    const double dx = x - mean_x / n, dy = y - mean_y / n;
    xx += dx * dx, yy += dy * dy, xy += dx * dy;
  }
  return CurveSimilarity{std::sqrt(std::max(0.0, xx + yy - 2 * xy) / n),
                         xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0};
}

std::vector<NearestGyro> find_nearest_gyros(const std::vector<TaskResult>& outcomes) {
  const auto gyros = with_curves(outcomes);
  std::vector<NearestGyro> siblings;
  for (const TaskResult* one : gyros) {
    NearestGyro sibling{one, nullptr, {}};
    for (const TaskResult* other : gyros) {
      const auto likeness = one == other ? std::nullopt : compare_curves(*one, *other);
      if (likeness && (!sibling.nearest || likeness->difference_deg_per_h < sibling.likeness.difference_deg_per_h))
        sibling.nearest = other, sibling.likeness = *likeness;
    }
    if (sibling.nearest) siblings.push_back(sibling);
  }
  std::stable_sort(siblings.begin(), siblings.end(), [](const NearestGyro& a, const NearestGyro& b) {
    return a.likeness.difference_deg_per_h < b.likeness.difference_deg_per_h;
  });
  return siblings;
}

std::vector<Drift> find_drift(const std::vector<TaskResult>& now, const std::vector<TaskResult>& before) {
  std::map<std::pair<std::string, std::string>, const TaskResult*> known;
  for (const TaskResult& outcome : before) {
    if (!outcome.refused) known[{outcome.gyro, outcome.model}] = &outcome;
  }
  std::vector<Drift> drifts;
  for (const TaskResult& outcome : now) {
    const auto found = known.find({outcome.gyro, outcome.model});
    if (outcome.refused || found == known.end()) continue;
    Drift drift{&outcome, found->second, {}, {}};
    if (outcome.mean_deg_per_h && found->second->mean_deg_per_h)
      drift.mean_deg_per_h = *outcome.mean_deg_per_h - *found->second->mean_deg_per_h;
    if (const auto likeness = compare_curves(outcome, *found->second))
      drift.curve_deg_per_h = likeness->difference_deg_per_h;
    drifts.push_back(drift);
  }
  return drifts;
}

}  // namespace prism::campaign
