// SPDX-License-Identifier: MIT
// Andrew's monotone chain, the lower half, one point at a time.
#include "drivers/lower_hull.hpp"

#include <algorithm>

namespace prism::drivers {
namespace {

/// If the clock drift only increases, every point is on the hull; half of them are sufficient.
constexpr std::size_t kMaxPoints = 4096;

}  // namespace

void LowerHull::clear() { hull_.clear(); }

void LowerHull::push(double x, double y) {
  least_ = hull_.empty() ? y - x : std::min(least_, y - x);
  while (hull_.size() >= 2) {
    const Point& a = hull_[hull_.size() - 2];
    const Point& b = hull_.back();
    if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0) break;  // a, b, new turn left: b stays
    hull_.pop_back();
  }
  hull_.push_back({x, y});
  if (hull_.size() > kMaxPoints) thin();
}

void LowerHull::thin() {
  std::size_t kept = 1;
  for (std::size_t i = 2; i + 1 < hull_.size(); i += 2) hull_[kept++] = hull_[i];
  hull_[kept++] = hull_.back();
  hull_.resize(kept);
}

LowerHull::StraightLine LowerHull::edge() const {
  if (hull_.size() < 2) return nominal();
  const double middle = 0.5 * (hull_.front().x + hull_.back().x);
  const auto right =
      std::lower_bound(hull_.begin() + 1, hull_.end() - 1, middle, [](const Point& p, double m) { return p.x < m; });
  const Point& b = *right;
  const Point& a = *(right - 1);
  return {a.x, a.y, (b.y - a.y) / (b.x - a.x)};
}

}  // namespace prism::drivers
