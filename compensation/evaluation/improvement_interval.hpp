// SPDX-License-Identifier: MIT
// How far the improvement of one recording may be from that of the next one.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "base/result.hpp"

namespace prism::evaluation {

/// From day to day the ratio of the sigmas moves by this much, 1 sigma of its logarithm, beyond what one recording
/// shows of itself (another voltage, another turn-on). Assumed wherever there is one recording only: of simulated days,
/// docs/science.md.
inline constexpr double kBetweenDays = 0.09;

/// Of what a recording's residual scatters, the share that the next one repeats, as hidden causes of temperature do: it
/// does not part the two. Of simulated days, likewise.
inline constexpr double kRepeats = 0.4;

/// A figure of one recording, and where 95 % of those of further recordings of the same profile lie.
struct NextRecording {
  double value = 0;       ///< of this recording
  double low = 0;         ///< 2.5 % of further ones are below
  double high = 0;        ///< 2.5 % are above
  std::size_t block = 0;  ///< how many values a drawn block has

  /// The next recording may show the opposite, or nothing.
  bool holds_zero() const { return low <= 0 && high >= 0; }
};

/// The improvement 1 − sd(after)/sd(before), a share. Circular block bootstrap of the residual `after` on the fixed
/// prediction `before` − `after`, 1 000 draws with a fixed seed; the interval is that of Student's t on the logarithm
/// of the ratio, with as many degrees of freedom as the recording has blocks, less one, and kBetweenDays; all of it
/// twice, as the next recording scatters as this one does, but for kRepeats. Refused: fewer than 20 values, lengths
/// that differ, values not finite, a series that stands still.
Result<NextRecording> next_improvement(std::span<const double> before, std::span<const double> after,
                                       const std::string& where);

/// The improvement of `second` less that of `first`, both corrections of the same recording `before`: the pairs are
/// drawn together, and what moves both from day to day cancels. Refused likewise.
Result<NextRecording> next_difference(std::span<const double> before, std::span<const double> first,
                                      std::span<const double> second, const std::string& where);

/// What 95 % of further recordings improve, from the improvements of several recordings alone (shares, each below 1):
/// Student's t on the logarithms of the ratios that are left, with the recordings' own spread. `value` is their mean,
/// `block` 1. Refused: fewer than 3, or one that is not finite or not below 1.
Result<NextRecording> next_of_several(std::span<const double> improvements, const std::string& where);

/// How many neighbours to draw together: the block length with the least error of a mean's variance, from the
/// autocorrelation (Politis and White 2004, corrected by Patton, Politis and White 2009), 1 to a quarter of the values.
/// A series that stands still remembers nothing: 1.
std::size_t bootstrap_block(std::span<const double> values);

}  // namespace prism::evaluation
