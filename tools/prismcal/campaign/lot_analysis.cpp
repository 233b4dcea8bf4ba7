// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/lot_analysis.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "compensation/evaluation/statistics.hpp"

namespace prism::campaign {
namespace {

constexpr std::size_t kMinValues = 8, kMinBins = 4;

/// Quantile with linear interpolation.
double quantile(const std::vector<double>& sorted, double share) {
  const double position = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const double part = position - static_cast<double>(below);
  return below + 1 < sorted.size() ? sorted[below] + part * (sorted[below + 1] - sorted[below]) : sorted.back();
}

/// One result per gyro: all its models have the same training recordings, and so the same curve.
std::vector<const TaskResult*> with_curves(const std::vector<TaskResult>& results) {
  std::vector<const TaskResult*> found;
  std::set<std::string> seen;
  for (const TaskResult& result : results) {
    if (result.curve.size() >= kMinBins && seen.insert(result.gyro).second) found.push_back(&result);
  }
  return found;
}

}  // namespace

std::optional<double> lot_value(const TaskResult& result, const std::string& quantity) {
  if (quantity == "mean_of_training_deg_per_h") return result.mean_deg_per_h;
  const RecordingResult* repeat = result.repeat();
  if (!repeat) return std::nullopt;
  return quantity == "before_deg_per_h" ? repeat->before_deg_per_h : repeat->value(quantity);
}

LotStatistics statistics_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return {values.size(),          values.front(), quantile(values, 0.05),       quantile(values, 0.5),
          quantile(values, 0.95), values.back(),  evaluation::robust_sd(values)};
}

std::vector<Outlier> find_outliers(const std::vector<TaskResult>& results) {
  std::map<std::string, std::vector<const TaskResult*>> models;
  for (const TaskResult& result : results) models[result.model].push_back(&result);
  std::vector<Outlier> outliers;
  for (const auto& [model, members] : models) {
    for (const LotQuantity& quantity : kLotQuantities) {
      std::vector<double> values;
      for (const TaskResult* result : members) {
        if (const auto value = lot_value(*result, quantity.name)) values.push_back(*value);
      }
      if (values.size() < kMinValues) continue;
      const LotStatistics lot = statistics_of(values);
      if (!(lot.robust_sd > 0)) continue;
      for (const TaskResult* result : members) {
        const auto value = lot_value(*result, quantity.name);
        const double score = value ? (*value - lot.median) / lot.robust_sd : 0;
        if (std::abs(score) > kOutlierScore) outliers.push_back({result, quantity.name, *value, score});
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
  if (both.size() < kMinBins) return std::nullopt;
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

std::vector<NearestGyro> find_nearest_gyros(const std::vector<TaskResult>& results) {
  const auto gyros = with_curves(results);
  std::vector<NearestGyro> pairs;
  for (const TaskResult* one : gyros) {
    NearestGyro pair{one, nullptr, {}};
    for (const TaskResult* other : gyros) {
      const auto similarity = one == other ? std::nullopt : compare_curves(*one, *other);
      if (similarity && (!pair.nearest || similarity->difference_deg_per_h < pair.similarity.difference_deg_per_h))
        pair.nearest = other, pair.similarity = *similarity;
    }
    if (pair.nearest) pairs.push_back(pair);
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const NearestGyro& a, const NearestGyro& b) {
    return a.similarity.difference_deg_per_h < b.similarity.difference_deg_per_h;
  });
  return pairs;
}

std::vector<Drift> find_drift(const std::vector<TaskResult>& now, const std::vector<TaskResult>& before) {
  std::map<std::pair<std::string, std::string>, const TaskResult*> known;
  for (const TaskResult& result : before) {
    if (!result.refused) known[{result.gyro, result.model}] = &result;
  }
  std::vector<Drift> drifts;
  for (const TaskResult& result : now) {
    const auto found = known.find({result.gyro, result.model});
    if (result.refused || found == known.end()) continue;
    Drift drift{&result, found->second, {}, {}};
    if (result.mean_deg_per_h && found->second->mean_deg_per_h)
      drift.mean_deg_per_h = *result.mean_deg_per_h - *found->second->mean_deg_per_h;
    if (const auto similarity = compare_curves(result, *found->second))
      drift.curve_deg_per_h = similarity->difference_deg_per_h;
    drifts.push_back(drift);
  }
  return drifts;
}

}  // namespace prism::campaign
