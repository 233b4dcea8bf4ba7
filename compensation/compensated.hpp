// SPDX-License-Identifier: MIT
// What the compensation tells the world: raw, bias and corrected rate together, and how far to trust them.
#pragma once

#include <cstdint>
#include <string>

#include "compensation/features.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/sample.hpp"

namespace prism::compensation {

/// Bits; 0 is a correction without reservation.
enum Quality : std::uint32_t {
  kGood = 0,
  kWarming = 1,         ///< the window is not full since the start or the last gap
  kNoModel = 2,         ///< no model is loaded: nothing is corrected
  kInputMissing = 4,    ///< an input of the model is not known: never carried, or no longer
  kExtrapolating = 8,   ///< the model is asked off the data it was trained on
  kFallback = 16,       ///< the fallback model, which needs no slope, gave the bias
  kOverLimit = 32,      ///< the predicted bias exceeded the sanity limit and was ignored
  kSettling = 64,       ///< the lag filters have not forgotten how they began
  kRateInvalid = 128,   ///< the device says that the rate is not valid
  kNoData = 256,        ///< nothing is measured now: the line is lost, silent, or brought no frame yet
  kImplausible = 512,   ///< a measured value is beyond what its sensor can say or do, and was left out
  kSlewLimited = 1024,  ///< the bias follows the model's at the greatest slew that is allowed
};

/// "good", or the names of the bits joined by '+': "warming+fallback".
std::string quality_text(std::uint32_t quality);

/// The same, written at `at`, which has room for kQualityChars; returns its end.
inline constexpr int kQualityChars = 128;
char* put_quality(char* at, std::uint32_t quality);

/// The bits that quality_text wrote; bits of unknown names are dropped.
std::uint32_t parse_quality(const std::string& text);

/// The bias in force, with what it is worth. bias_deg_per_h is kUnknown where no correction is possible.
struct Correction {
  double bias_deg_per_h = kUnknown;
  double sd_deg_per_h = kUnknown;       ///< of the true bias less this one, in a run that was not seen (Prediction)
  double sd_mean_deg_per_h = kUnknown;  ///< with the noise of the window's mean rate
  std::uint32_t quality = kNoModel;
};

/// The one place where a bias is subtracted. kUnknown where either is: never a silently uncorrected number.
inline double corrected_rate(double rate_deg_per_h, const Correction& correction) {
  return rate_deg_per_h - correction.bias_deg_per_h;
}

/// One sample, corrected with the bias of the last full second before it.
struct Compensated {
  Sample sample;
  Correction correction;
  double corrected_deg_per_h = kUnknown;
};

/// One second, corrected with the bias of the window that it completes: a row of the log.
struct CompensatedWindow {
  Window window;
  Correction correction;
  double corrected_deg_per_h = kUnknown;       ///< the second's mean rate − bias
  double corrected_mean_deg_per_h = kUnknown;  ///< the window's mean rate − bias
  Doubts doubts;                               ///< of the first sample of each quantity that was not believed
};

}  // namespace prism::compensation
