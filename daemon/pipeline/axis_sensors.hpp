// SPDX-License-Identifier: MIT
// The measured quantities of an axis, for code that treats them alike.
#pragma once

#include <array>

#include "compensation/compensated.hpp"

namespace prism::pipeline {

struct AxisSensor {
  const char *name, *unit;
  bool QuantitySet::*in_set;
  compensation::Rejection compensation::Rejections::*rejection;
  double compensation::SecondMean::*value;
};

inline constexpr std::array kAxisSensors = {
    AxisSensor{"rate", "deg/h", &QuantitySet::rate, &compensation::Rejections::rate,
               &compensation::SecondMean::rate_deg_per_h},
    AxisSensor{"temperature", "degC", &QuantitySet::temperature, &compensation::Rejections::temperature,
               &compensation::SecondMean::temperature_degc},
    AxisSensor{"uhfo", "V", &QuantitySet::uhfo, &compensation::Rejections::uhfo, &compensation::SecondMean::uhfo_v}};

}  // namespace prism::pipeline
