// SPDX-License-Identifier: MIT
// Power spectral density of a rate, and the periodic disturbances in it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace prism::evaluation {

/// A periodic part of the rate.
struct SpectralLine {
  double frequency_hz = 0;
  double amplitude = 0;  ///< of a sine, in the rate's unit
};

struct Spectrum {
  /// One-sided density, squares of the rate's unit per Hz, averaged over at most 40 intervals of equal ratio per
  /// decade. White noise N (deg/√h) has 2 N² · 3600 (deg/h)²/Hz.
  std::vector<double> frequency_hz, density;
  std::vector<SpectralLine> lines;  ///< the largest first, at most 10
  std::size_t segments = 0, segment_values = 0;
};

/// Welch's estimate (1967): Hann windows that overlap by half, each without its mean, of at most an eighth of the
/// values. Missing values (NaN, kAllanBreak) count as the mean; a segment with less than 95 % of its values is left
/// out. A line is a peak that noise with the density of its neighbours would reach in one of a thousand spectra.
/// Errors: no segment of 64 values.
Result<Spectrum> power_spectrum(std::span<const double> rate, double tau0_s, const std::string& where);

}  // namespace prism::evaluation
