// SPDX-License-Identifier: MIT
#include "compensation/training/gross_outliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "compensation/training/reweighting.hpp"

namespace prism::training {
namespace {

constexpr Eigen::Index kFewest = 20, kNeighbours = 65, kCompared = 2000;
constexpr int kPasses = 6;  // each pass finds the rows that the previous ones hid

double median_among(std::vector<double> values) { return order_statistic(std::move(values), 0.5); }

// Distance of each row's target to the median of its neighbours in time.
Eigen::VectorXd from_time(const Eigen::VectorXd& y, const std::vector<int>& runs, Eigen::Index neighbours) {
  Eigen::VectorXd distance(y.size());
  for (Eigen::Index begin = 0; begin < y.size();) {
    Eigen::Index end = begin;
    while (end < y.size() && runs[static_cast<std::size_t>(end)] == runs[static_cast<std::size_t>(begin)]) ++end;
    const Eigen::Index count = std::min(neighbours, end - begin);
    for (Eigen::Index i = begin; i < end; ++i) {
      const Eigen::Index first = std::clamp(i - count / 2, begin, end - count);
      distance[i] = y[i] - median_among({y.begin() + first, y.begin() + first + count});
    }
    begin = end;
  }
  return distance.cwiseAbs();
}

// Inputs in robust scales, so that no single value sets their unit.
Eigen::MatrixXd in_scales(const Eigen::MatrixXd& inputs) {
  Eigen::MatrixXd x = inputs;
  for (Eigen::Index j = 0; j < x.rows(); ++j) {
    const Eigen::VectorXd row = inputs.row(j);
    const double scale = robust_scale(row, ScaleKind::kMad);
    if (scale > 0) x.row(j) /= scale;
  }
  return x;
}

// Distance of each row's target to the median of the rows with the nearest inputs.
Eigen::VectorXd from_inputs(const Eigen::MatrixXd& x, const Eigen::VectorXd& y, Eigen::Index neighbours) {
  const Rows compared = thinned(y.size(), kCompared);
  const Eigen::MatrixXd near = x(Eigen::all, compared);
  const auto count = std::min(static_cast<std::size_t>(neighbours), compared.size());
  std::vector<std::pair<double, std::size_t>> order(compared.size());
  std::vector<double> values(count);
  Eigen::VectorXd distance(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const Eigen::VectorXd squares = (near.colwise() - x.col(i)).colwise().squaredNorm().transpose();
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = {squares[static_cast<Eigen::Index>(k)], k};
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count - 1), order.end());
    for (std::size_t k = 0; k < count; ++k) values[k] = y[compared[order[k].second]];
    distance[i] = std::abs(y[i] - median_among(values));
  }
  return distance;
}

// The unit of "far": the scale of the distances; if more than half of them are 0, as with coarse targets, their 80 %
// quantile.
double unit_of(const Eigen::VectorXd& distance) {
  const std::vector<double> values(distance.begin(), distance.end());
  const double scale = kPaperMadToSd * order_statistic(values, 0.5);
  if (scale > 0) return scale;
  const double most = order_statistic(values, 0.8);
  return most > 0 ? most : std::numeric_limits<double>::infinity();
}

}  // namespace

Rows gross_outliers(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& target, const std::vector<int>& runs,
                    double scales) {
  Rows kept = others({}, target.size()), found;
  const Eigen::MatrixXd x = in_scales(inputs);
  for (int pass = 0; pass < kPasses && static_cast<Eigen::Index>(kept.size()) >= kFewest; ++pass) {
    const Eigen::Index neighbours = std::min<Eigen::Index>(kNeighbours, static_cast<Eigen::Index>(kept.size()) / 2);
    const Eigen::VectorXd y = target(kept);
    const Eigen::VectorXd time = from_time(y, taken(runs, kept), neighbours);
    const double time_limit = scales * unit_of(time);
    if ((time.array() <= time_limit).all()) break;  // spares clean records the neighbours
    const Eigen::VectorXd near = from_inputs(x(Eigen::all, kept), y, neighbours);
    const double near_limit = scales * unit_of(near);
    Rows rest;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      (time[at] > time_limit && near[at] > near_limit ? found : rest).push_back(kept[i]);
    }
    if (rest.size() == kept.size()) break;
    kept = std::move(rest);
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string rows_text(const Rows& rows) {
  constexpr std::size_t kNamed = 6;  // ranges
  std::vector<std::string> ranges;
  std::size_t left = 0;
  for (std::size_t begin = 0; begin < rows.size();) {
    std::size_t end = begin + 1;
    while (end < rows.size() && rows[end] == rows[end - 1] + 1) ++end;
    if (ranges.size() == kNamed) {
      left = rows.size() - begin;
      break;
    }
    ranges.push_back(end - begin == 1 ? fmt::format("{}", rows[begin] + 1)
                                      : fmt::format("{} to {}", rows[begin] + 1, rows[end - 1] + 1));
    begin = end;
  }
  return fmt::format("{}{}", fmt::join(ranges, ", "), left ? fmt::format(" and {} others", left) : "");
}

}  // namespace prism::training
