// SPDX-License-Identifier: MIT
#include "compensation/plausibility.hpp"

#include <fmt/format.h>

namespace prism::compensation {
namespace {

constexpr std::int64_t kBaselineNs = 1'000'000'000;

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

std::string doubt_text(const Doubt& doubt, const char* unit) {
  switch (doubt.reason) {
    case Doubt::Reason::kOutOfRange:
      return fmt::format("found {:.6g} {}, expected {:.6g} to {:.6g}", doubt.found, unit, doubt.low, doubt.high);
    case Doubt::Reason::kTooFast:
      return fmt::format("found {:.6g} {}, expected {:.6g} to {:.6g}: it was {:.6g} {:.3g} s before", doubt.found, unit,
                         doubt.low, doubt.high, (doubt.low + doubt.high) / 2, doubt.seconds);
    case Doubt::Reason::kStuck:
      return fmt::format("found {:.6g} {} for {:.6g} s, expected it to change", doubt.found, unit, doubt.seconds);
    case Doubt::Reason::kOutOfBounds:
      return "found a value outside the min or max of its field, expected one within";
    case Doubt::Reason::kNone:
      break;
  }
  return {};
}

SensorCheck::SensorCheck(const SensorLimits& limits)
    : limits_(limits),
      has_slope_(std::isfinite(limits.greatest_slope_per_s)),
      may_stick_(std::isfinite(limits.stuck_s)) {}

bool SensorCheck::out_of_range(double value) {
  doubt_ = {Doubt::Reason::kOutOfRange, value, limits_.low, limits_.high};
  return false;
}

bool SensorCheck::slope_holds(double value, std::int64_t time_ns) {
  if (before_ns_ == kNever) before_ns_ = time_ns;  // start of the session
  if (!std::isnan(before_)) {
    const double elapsed_s = seconds_between(before_ns_, time_ns);
    const double most = limits_.step + limits_.greatest_slope_per_s * elapsed_s;
    if (!(std::fabs(value - before_) <= most)) {
      doubt_ = {Doubt::Reason::kTooFast, value, before_ - most, before_ + most, elapsed_s};
      return false;
    }
  }
  if (time_ns - before_ns_ < kBaselineNs) return true;
  before_ = value;
  before_ns_ = time_ns;
  return true;
}

bool SensorCheck::moves(double value, std::int64_t time_ns) {
  if (value != still_) {
    still_ = value;
    still_since_ns_ = time_ns;
  }
  const double still_s = seconds_between(still_since_ns_, time_ns);
  if (still_s <= limits_.stuck_s) return true;
  doubt_ = {Doubt::Reason::kStuck, value, kUnknown, kUnknown, still_s};
  return false;
}

Plausibility::Plausibility(const PlausibilityLimits& limits)
    : rate_(limits.rate), temperature_(limits.temperature), uhfo_(limits.uhfo) {}

void Plausibility::explain(const Sample& sample, QuantitySet implausible, Doubts& doubts) const {
  const auto note = [](bool doubted, bool out_of_bounds, const SensorCheck& check, Doubt& doubt) {
    if (doubted && !doubt) doubt = out_of_bounds ? Doubt{Doubt::Reason::kOutOfBounds} : check.doubt();
  };
  note(implausible.rate, sample.out_of_bounds.rate, rate_, doubts.rate);
  note(implausible.temperature, sample.out_of_bounds.temperature, temperature_, doubts.temperature);
  note(implausible.uhfo, sample.out_of_bounds.uhfo, uhfo_, doubts.uhfo);
}

}  // namespace prism::compensation
