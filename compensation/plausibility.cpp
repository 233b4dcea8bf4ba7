// SPDX-License-Identifier: MIT
#include "compensation/plausibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace prism::compensation {

double greatest_slew_deg_per_h_per_s(const Model& model, const SlewSettings& settings, double max_bias_deg_per_h) {
  if (!settings.limited) return std::numeric_limits<double>::infinity();
  if (settings.max_slew_deg_per_h_per_s) return *settings.max_slew_deg_per_h_per_s;
  const double own = model.bias_span_deg_per_h();
  const double span = std::isfinite(own) ? std::min(own, 2 * max_bias_deg_per_h) : 2 * max_bias_deg_per_h;
  return std::max(kLeastSlew, kSlewMargin * span / model.info().features.length_s);
}

bool SlewLimit::follow(double& bias_deg_per_h, std::int64_t second, const Model& by, double most_deg_per_h_per_s) {
  const double wanted = bias_deg_per_h;
  const double most = most_deg_per_h_per_s * static_cast<double>(second - second_);
  if (by_ == &by && most > 0 && std::isfinite(most))
    bias_deg_per_h = std::clamp(wanted, bias_deg_per_h_ - most, bias_deg_per_h_ + most);
  by_ = &by;
  bias_deg_per_h_ = bias_deg_per_h;
  second_ = second;
  return bias_deg_per_h != wanted;
}

namespace {

constexpr std::int64_t kBaselineNs = 1'000'000'000;
constexpr int kAgreeing = 2, kEnough = 3;  // values that the first reference needs: these agree, or that many in all

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) { return static_cast<double>(to_ns - from_ns) / 1e9; }

}  // namespace

void SensorLimits::take(const SensorStatement& stated) {
  if (stated.range) low = stated.range->min, high = stated.range->max;
  greatest_slope_per_s = stated.greatest_slope_per_s.value_or(greatest_slope_per_s);
  stuck_s = stated.stuck_s.value_or(stuck_s);
}

void PlausibilityLimits::take(const SensorStatements& stated) {
  rate.take(stated.rate);
  temperature.take(stated.temperature);
  uhfo.take(stated.uhfo);
}

std::string rejection_text(const Rejection& rejection, const char* unit) {
  switch (rejection.reason) {
    case Rejection::Reason::kOutsideLimits:
      return fmt::format("found {:.6g} {}, expected {:.6g} to {:.6g}", rejection.found, unit, rejection.low,
                         rejection.high);
    case Rejection::Reason::kTooFast:
      return fmt::format("found {:.6g} {}, expected {:.6g} to {:.6g}: it was {:.6g} {:.3g} s before", rejection.found,
                         unit, rejection.low, rejection.high, (rejection.low + rejection.high) / 2, rejection.seconds);
    case Rejection::Reason::kStuck:
      return fmt::format("found {:.6g} {} for {:.6g} s, expected it to change", rejection.found, unit,
                         rejection.seconds);
    case Rejection::Reason::kOutsideField:
      return "found a value outside the min or max of its field, expected one within";
    case Rejection::Reason::kNone:
      break;
  }
  return {};
}

SensorCheck::SensorCheck(const SensorLimits& limits)
    : limits_(limits),
      has_slope_(std::isfinite(limits.greatest_slope_per_s)),
      may_stick_(std::isfinite(limits.stuck_s)) {}

bool SensorCheck::outside_limits(double value) {
  rejection_ = {Rejection::Reason::kOutsideLimits, value, limits_.low, limits_.high};
  return false;
}

bool SensorCheck::slope_holds(double value, std::int64_t time_ns) {
  if (!has_reference_) return find_reference(value, time_ns);
  const double elapsed_s = seconds_between(reference_ns_, time_ns);
  if (!follows(value, elapsed_s)) {
    const double most = limits_.step + limits_.greatest_slope_per_s * elapsed_s;
    rejection_ = {Rejection::Reason::kTooFast, value, reference_ - most, reference_ + most, elapsed_s};
    return false;
  }
  if (time_ns - reference_ns_ < kBaselineNs) return true;
  reference_ = value;
  reference_ns_ = time_ns;
  return true;
}

bool SensorCheck::follows(double value, double elapsed_s) const {
  return std::fabs(value - reference_) <= limits_.step + limits_.greatest_slope_per_s * elapsed_s;
}

// Majority vote (Boyer and Moore 1981) over the first second: a fast frame repeats a thermometer's spike many times.
bool SensorCheck::find_reference(double value, std::int64_t time_ns) {
  if (start_ns_ == kNever) start_ns_ = time_ns;
  if (votes_ == 0) {
    reference_ = value;
    reference_ns_ = time_ns;
  }
  const bool agrees = follows(value, std::max(1.0, seconds_between(reference_ns_, time_ns)));
  votes_ += agrees ? 1 : -1;
  ++values_;
  if (time_ns - start_ns_ < kBaselineNs) return true;
  if (votes_ < kAgreeing && values_ < kEnough) return true;
  has_reference_ = true;
  if (!agrees) return slope_holds(value, time_ns);
  reference_ = value;
  reference_ns_ = time_ns;
  return true;
}

bool SensorCheck::moves(double value, std::int64_t time_ns) {
  if (value != still_) {
    still_ = value;
    still_since_ns_ = time_ns;
  }
  const double still_s = seconds_between(still_since_ns_, time_ns);
  if (still_s <= limits_.stuck_s) return true;
  rejection_ = {Rejection::Reason::kStuck, value, kUnknown, kUnknown, still_s};
  return false;
}

Plausibility::Plausibility(const PlausibilityLimits& limits)
    : rate_(limits.rate), temperature_(limits.temperature), uhfo_(limits.uhfo) {}

void Plausibility::explain(const Sample& sample, QuantitySet implausible, Rejections& rejections) const {
  const auto note = [](bool is_implausible, bool out_of_bounds, const SensorCheck& check, Rejection& rejection) {
    if (is_implausible && !rejection)
      rejection = out_of_bounds ? Rejection{Rejection::Reason::kOutsideField} : check.rejection();
  };
  note(implausible.rate, sample.out_of_bounds.rate, rate_, rejections.rate);
  note(implausible.temperature, sample.out_of_bounds.temperature, temperature_, rejections.temperature);
  note(implausible.uhfo, sample.out_of_bounds.uhfo, uhfo_, rejections.uhfo);
}

}  // namespace prism::compensation
