// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/jump_finder.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compensation/plausibility.hpp"
#include "tools/prismcal/recordings/leave_out.hpp"

namespace prism::recordings {

void JumpFinder::push(const compensation::SecondMean& second_mean, bool begins_session) {
  if (begins_session) watch_ = {};
  if (begins_session) last_degc_ = kUnknown;
  const double now = second_mean.temperature_degc;
  if (second_mean.implausible.temperature) {
    // A log does not state the quantity: a smaller step is not the temperature's.
    const double step = compensation::PlausibilityLimits{}.temperature.step;
    const bool rejects = second_mean.all_implausible.temperature && std::isfinite(now) && !std::isnan(last_degc_) &&
                         (watch_.is_rejecting() || std::fabs(now - last_degc_) > step);
    if (!rejects) return;
    if (!watch_.is_rejecting()) from_ = second_mean.second;
    until_ = second_mean.second;
    watch_.reject({compensation::Rejection::Reason::kTooFast, now, last_degc_, last_degc_});
    return;
  }
  if (!std::isfinite(now)) return;
  last_degc_ = now;
  const auto stayed = watch_.accept(now);
  if (!stayed) return;
  if (!jumps_.empty() && !jumps_.back().to) {
    Jump& open = jumps_.back();
    if (std::fabs(now - open.values.before) < std::fabs(now - open.values.after)) {
      open.to = until_;
      return;
    }
  }
  jumps_.push_back({*stayed, from_, std::nullopt});
}

std::vector<std::string> JumpFinder::questions(bool is_date) const {
  std::vector<std::string> texts;
  for (const Jump& jump : jumps_) {
    const auto option = [&](std::int64_t second) {
      return is_date ? end_of_second(second, true) : fmt::format("{}", second + 1);
    };
    texts.push_back(fmt::format(
        "temperature jumped from {:.1f} to {:.1f} degC at {} and {}: a fault, or true? If it is a fault: --leave-out "
        "{}..{}",
        jump.values.before, jump.values.after, end_of_second(jump.from, is_date),
        jump.to ? fmt::format("back at {}", end_of_second(*jump.to, is_date)) : "stayed", option(jump.from),
        jump.to ? option(*jump.to) : ""));
  }
  return texts;
}

}  // namespace prism::recordings
