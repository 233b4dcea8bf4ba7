// SPDX-License-Identifier: MIT
#include "compensation/training/folds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

namespace prism::training {
namespace {

template <class Number>
std::vector<int> without_gaps(const std::vector<Number>& numbers) {
  std::map<Number, int> place;
  for (const Number number : numbers) place.emplace(number, 0);
  int next = 0;
  for (auto& [number, at] : place) at = next++;
  std::vector<int> result;
  for (const Number number : numbers) result.push_back(place[number]);
  return result;
}

}  // namespace

Folds shuffled_folds(std::size_t n, int k, std::uint64_t seed) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937_64 random(seed);
  // std::shuffle may differ between libraries; this shuffle is the same everywhere.
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  const std::size_t folds = std::clamp<std::size_t>(static_cast<std::size_t>(k), 1, n), size = n / folds;
  Folds fold(n);
  for (std::size_t i = 0; i < n; ++i) fold[order[i]] = static_cast<int>(std::min(i / size, folds - 1));
  return fold;
}

Folds blocked_folds(const std::vector<int>& runs, int k) {
  const std::size_t n = runs.size();
  Folds fold(n);
  int next = 0;
  for (std::size_t begin = 0; begin < n;) {
    std::size_t end = begin;
    while (end < n && runs[end] == runs[begin]) ++end;
    const std::size_t length = end - begin;
    const double share = static_cast<double>(k) * static_cast<double>(length) / static_cast<double>(n);
    const std::size_t blocks = std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(share)), 1, length);
    for (std::size_t i = begin; i < end; ++i) fold[i] = next + static_cast<int>((i - begin) * blocks / length);
    next += static_cast<int>(blocks);
    begin = end;
  }
  return fold;
}

Result<Folds> folds_from(const std::vector<double>& column) {
  for (const double value : column) {
    if (value != std::floor(value)) return make_error("fold column", fmt::format("found {}, expected integers", value));
  }
  Folds folds = without_gaps(column);
  if (fold_count(folds) < 2)
    return make_error("fold column", fmt::format("found {} folds, expected at least 2", fold_count(folds)));
  return folds;
}

std::vector<int> numbered(const std::vector<int>& numbers) { return without_gaps(numbers); }

int fold_count(const Folds& folds) { return folds.empty() ? 0 : *std::max_element(folds.begin(), folds.end()) + 1; }

std::vector<Eigen::Index> thinned(Eigen::Index rows, Eigen::Index most) {
  const Eigen::Index step = (rows + most - 1) / most;
  std::vector<Eigen::Index> part;
  for (Eigen::Index i = 0; i < rows; i += step) part.push_back(i);
  return part;
}

std::vector<int> taken(const std::vector<int>& of_rows, const std::vector<Eigen::Index>& rows) {
  std::vector<int> part;
  for (const Eigen::Index i : rows) part.push_back(of_rows[static_cast<std::size_t>(i)]);
  return part;
}

std::vector<Eigen::Index> others(const std::vector<Eigen::Index>& members, Eigen::Index count) {
  std::vector<char> out(static_cast<std::size_t>(count), 0);
  for (const Eigen::Index i : members) out[static_cast<std::size_t>(i)] = 1;
  std::vector<Eigen::Index> rest;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!out[static_cast<std::size_t>(i)]) rest.push_back(i);
  }
  return rest;
}

std::vector<std::vector<Eigen::Index>> fold_members(const Folds& folds) {
  std::vector<std::vector<Eigen::Index>> members(static_cast<std::size_t>(fold_count(folds)));
  for (std::size_t i = 0; i < folds.size(); ++i)
    members[static_cast<std::size_t>(folds[i])].push_back(static_cast<Eigen::Index>(i));
  return members;
}

}  // namespace prism::training
