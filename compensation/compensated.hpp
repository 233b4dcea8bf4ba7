// SPDX-License-Identifier: MIT
// Output of the compensation: raw rate, bias and corrected rate with their quality flags.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "compensation/features.hpp"
#include "compensation/plausibility.hpp"
#include "compensation/sample.hpp"

namespace prism::compensation {

/// Bits; 0 is a correction without restrictions.
enum Quality : std::uint32_t {
  kGood = 0,
  kWarming = 1,          ///< the window is not yet full after the start or a gap
  kNoModel = 2,          ///< no model is loaded: nothing is corrected
  kInputMissing = 4,     ///< an input of the model is unknown: not measured or out of date
  kExtrapolating = 8,    ///< the inputs are outside the training range of the model
  kFallback = 16,        ///< the bias is of the fallback model, which needs no slope
  kOverLimit = 32,       ///< the predicted bias exceeded the sanity limit and was ignored
  kSettling = 64,        ///< the response of the gyro's body has not settled since its start
  kRateInvalid = 128,    ///< the device flags the rate as invalid
  kNoData = 256,         ///< no current data: the line is lost or silent, or no frame has arrived yet
  kImplausible = 512,    ///< a measured value is outside the limits of its sensor and was left out
  kSlewLimited = 1024,   ///< the slew limit holds the published bias back from the model's bias
  kClocksDiffer = 2048,  ///< frames arrive at another rate than described: times and slopes are wrong
};

/// "good", or the names of the bits joined by '+': "warming+fallback".
std::string quality_text(std::uint32_t quality);

/// Writes the same text at `at`, which has space for kQualityChars; returns its end.
inline constexpr int kQualityChars = 144;
char* put_quality(char* at, std::uint32_t quality);

/// The bits of a text from quality_text(); ignores unknown names.
std::uint32_t parse_quality(std::string_view text);

/// The bias in force and its uncertainty. bias_deg_per_h is kUnknown if no correction is possible.
struct Correction {
  double bias_deg_per_h = kUnknown;
  double sd_deg_per_h = kUnknown;       ///< of the true bias minus this one, in a new run (Prediction)
  double sd_mean_deg_per_h = kUnknown;  ///< with the noise of the window's mean rate
  std::uint32_t quality = kNoModel;
  double offset_deg_per_h = kUnknown;  ///< by command, subtracted besides the bias; kUnknown: none

  /// The value that is subtracted from a rate.
  double sum_deg_per_h() const {
    return std::isnan(offset_deg_per_h) ? bias_deg_per_h : bias_deg_per_h + offset_deg_per_h;
  }
};

/// The only place where a bias is subtracted. Returns kUnknown if either is unknown: never a silently uncorrected rate.
inline double corrected_rate(double rate_deg_per_h, const Correction& correction) {
  return rate_deg_per_h - correction.sum_deg_per_h();
}

/// One sample, corrected with the bias of the last complete second before it.
struct Compensated {
  Sample sample;
  Correction correction;
  double corrected_deg_per_h = kUnknown;
};

/// One second, corrected with the bias of the window that it completes: a row of the log.
struct CompensatedWindow {
  Window window;
  Correction correction;
  double corrected_deg_per_h = kUnknown;       ///< the second's mean rate − bias − offset
  double corrected_mean_deg_per_h = kUnknown;  ///< the window's mean rate − bias − offset
  double sent_deg_per_h = kUnknown;            ///< mean of the rates that the first output sent in the second
  Rejections rejections;                       ///< of the first implausible sample of each quantity
};

}  // namespace prism::compensation
