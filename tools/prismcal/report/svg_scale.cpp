// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/svg_scale.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace prism::report {
namespace {

constexpr double kLargest = 1e150, kSmallestSpan = 1e-12, kRounding = 1e-6;

/// Returns 1, 2 or 5 times a power of ten, so that about `count` steps cover `span`.
double nice_step(double span, double count) {
  const double raw = span / std::max(1.0, count), power = std::pow(10, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit <= 1 ? 1 : digit <= 2 ? 2 : digit <= 5 ? 5 : 10);
}

/// Enough digits to distinguish neighbouring ticks.
std::string number_label(double value, double step) {
  if (std::abs(value) < kRounding * step) return "0";
  const int digits = static_cast<int>(std::floor(std::log10(std::abs(value))) - std::floor(std::log10(step))) + 1;
  return fmt::format("{:.{}g}", value, std::clamp(digits, 6, 15));
}

}  // namespace

void Range::add(double value) {
  low = std::min(low, value);
  high = std::max(high, value);
}

bool is_drawable(double value, bool logarithmic) {
  return std::abs(value) < kLargest && (!logarithmic || value > 1 / kLargest);
}

std::vector<double> grid_edges(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !is_drawable(v, false); });
  std::sort(values.begin(), values.end());
  const auto is_same = [](double a, double b) { return b - a < 1e-9 * std::abs(b) + 1e-12; };
  values.erase(std::unique(values.begin(), values.end(), is_same), values.end());
  if (values.size() < 2) return {};
  std::vector<double> edges = {1.5 * values[0] - 0.5 * values[1]};
  for (std::size_t i = 0; i + 1 < values.size(); ++i) edges.push_back(0.5 * (values[i] + values[i + 1]));
  edges.push_back(2 * values.back() - edges.back());
  return edges;
}

std::string svg_number(double pixels) {
  std::string text = fmt::format("{:.2f}", std::isnan(pixels) ? 0 : std::clamp(pixels, -20000.0, 20000.0));
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

Scale::Scale(const Axis& axis, Range data, double low_px, double high_px, double room_px, bool extend)
    : logarithmic_(axis.logarithmic), low_px_(low_px), high_px_(high_px) {
  const bool fixed_low = axis.min && shows(*axis.min), fixed_high = axis.max && shows(*axis.max);
  if (data.low > data.high) data = logarithmic_ ? Range{1, 10} : Range{0, 1};
  if (fixed_low) data.low = *axis.min;
  if (fixed_high) data.high = *axis.max;
  low_ = logarithmic_ ? std::log10(data.low) : data.low;
  high_ = logarithmic_ ? std::log10(data.high) : data.high;
  const double smallest = std::max(logarithmic_ ? 1e-9 : 1 / kLargest,  // keeps ticks different
                                   kSmallestSpan * std::max(std::abs(low_), std::abs(high_)));
  if (!(high_ - low_ > smallest)) {
    const double room = std::abs(low_) > 1 / kLargest && !logarithmic_ ? 0.05 * std::abs(low_) : 0.5;
    high_ = low_ + room;  // one value, or ends in the wrong order
    low_ -= room;
  }
  const double count = std::abs(high_px - low_px) / (logarithmic_ ? std::max(20.0, 0.6 * room_px) : room_px);
  const double step = std::max(nice_step(high_ - low_, count), logarithmic_ ? 1.0 : 0.0);
  extend = extend && (!logarithmic_ || high_ - low_ > 1);
  if (extend && !fixed_low) low_ = step * std::floor(low_ / step + kRounding);
  if (extend && !fixed_high) high_ = step * std::ceil(high_ / step - kRounding);
  if (!logarithmic_) {
    add_linear_ticks(low_, high_, step);
  } else if (high_ - low_ < 0.7) {
    const double low = std::pow(10, low_), high = std::pow(10, high_);
    add_linear_ticks(low, high, nice_step(high - low, count));
  } else if (high_ - low_ < 2) {
    add_digits(room_px);
  } else {
    add_powers(step);
  }
}

void Scale::add_linear_ticks(double low, double high, double step) {
  for (double i = std::ceil(low / step - kRounding); i * step <= high + kRounding * step; ++i)
    ticks_.push_back({px(i * step), number_label(i * step, step)});
}

/// Adds ticks at 1, 2 and 5 times the powers of ten, unless labels would touch.
void Scale::add_digits(double room_px) {
  for (double power = std::floor(low_); power <= high_ + kRounding; ++power) {
    for (const double digit : {1, 2, 5}) {
      const double position = power + std::log10(digit), value = digit * std::pow(10, power);
      if (position < low_ - kRounding || position > high_ + kRounding) continue;
      if (!ticks_.empty() && std::abs(at(position) - ticks_.back().at_px) < 0.5 * room_px) continue;
      ticks_.push_back({at(position), fmt::format("{:g}", value)});
    }
  }
}

void Scale::add_powers(double step) {
  for (double i = std::ceil(low_ / step - kRounding); i * step <= high_ + kRounding; ++i)
    ticks_.push_back({at(i * step), fmt::format("10<tspan dy=\"-4\" font-size=\"9\">{:.0f}</tspan>", i * step + 0.0)});
  if (step > 1) return;
  for (double power = std::floor(low_); power < high_; ++power) {
    for (int digit = 2; digit < 10; ++digit) {
      const double position = power + std::log10(digit);
      if (position > low_ && position < high_) minor_px_.push_back(at(position));
    }
  }
}

}  // namespace prism::report
