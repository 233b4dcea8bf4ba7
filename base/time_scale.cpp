// SPDX-License-Identifier: MIT
#include "base/time_scale.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "base/text_number.hpp"

namespace prism {
namespace {

constexpr const char* kVariable = "PRISM_TIME_SCALE";
constexpr double kMost = 100;

Result<double> read_scale() {
  const char* const text = std::getenv(kVariable);
  if (text == nullptr) return 1;
  const auto scale = parse_number<double>(text);
  if (!scale || *scale < 1 || *scale > kMost)
    return make_error(kVariable, "found \"" + std::string(text) + "\", expected a number within 1 to 100");
  return *scale;
}

double scale() { return read_scale().value_or(1); }

}  // namespace

Result<void> check_time_scale() {
  return read_scale().map([](double) {});
}

std::chrono::steady_clock::duration scaled(std::chrono::steady_clock::duration wait) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(wait / scale());
}

std::int64_t scaled_s(std::int64_t wait_s) {
  return std::max<std::int64_t>(std::llround(static_cast<double>(wait_s) / scale()), 1);
}

}  // namespace prism
