// SPDX-License-Identifier: MIT
// The phase of an Allan deviation: the running sum of a rate, computed in pieces when it is needed.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "compensation/evaluation/rate_source.hpp"

namespace prism::evaluation {

/// The rates between two breaks. Their phase x has values + 1 elements: x[0] = 0, x[n] = y_0 + … + y_{n−1}.
struct PhaseRecord {
  std::size_t begin = 0;             ///< position of the first rate in the series
  std::size_t values = 0;            ///< also the missing ones; the first and the last are not missing
  std::vector<std::size_t> missing;  ///< positions in the record, in order
  /// Of the least-squares line through the rates, per sample; 0 if no value is missing.
  double slope = 0;

  double level = 0, centre = 0;  ///< of the line, at the mean position
};

/// An element of the phase of a record with missing values: running sums over the rates before it, relative to the line
/// through the record. A missing value has a weight of 0, and its neighbours have weights that rise to 1 in steps of
/// 1 / taper, at most over half of a run: the errors of the angle at both ends of a gap then cancel as well as noise
/// allows.
struct LostPhase {
  double plain = 0;             ///< of the rates; a missing one adds 0
  double sum = 0;               ///< of weight · rate
  double weight = 0;            ///< of the weights
  double square = 0;            ///< of their squares
  double steps = 0;             ///< of the squared differences of neighbouring weights, with that at this element
  float before = 0, after = 0;  ///< weights of the rates before and after this element
};

/// Finds the records of a series, and computes pieces of their phase: with the same result, however it is divided. The
/// mean of the series is subtracted from the rates, because the Allan deviation does not depend on it; the sums stay
/// small and precise. In a record with missing values the line is subtracted as well: a missing value then does not
/// move the centre of a ramp.
///
/// The taper follows from the angle error q and the white noise n of the rate, of 1 and 8 values without a gap: at
/// a gap with weights that rise over a values, q adds 2 q / a to the variance of the sum and n adds 2 a n / 3, together
/// least for a = √(3 q / n).
///
/// Memory: 8 bytes per kRatePiece rates; with missing values 56, and 8 bytes per missing value.
class AllanPhase {
 public:
  /// `rate` must outlive the phase.
  explicit AllanPhase(const RateSource& rate);

  const std::vector<PhaseRecord>& records() const { return records_; }
  std::size_t values() const { return values_; }            ///< finite ones
  std::size_t missing() const { return missing_; }          ///< also those outside of records
  std::size_t gaps() const { return gaps_; }                ///< runs of missing values and breaks
  std::size_t runs() const { return runs_; }                ///< of values without a gap
  std::size_t longest_run() const { return longest_run_; }  ///< values
  std::size_t taper() const { return taper_; }              ///< values; 1: the neighbours of a gap count fully

  /// The pieces of the series that have elements of a record's phase, which are at the positions of the rates, from
  /// record.begin to record.begin + record.values.
  static std::size_t piece_of(std::size_t position) { return position / kRatePiece; }
  /// Writes the phase at the positions of a piece to `x`, at position − piece · kRatePiece; leaves other elements. The
  /// second: of a record with missing values.
  void read(const PhaseRecord& record, std::size_t piece, std::span<double, kRatePiece> x) const;
  void read(const PhaseRecord& record, std::size_t piece, std::span<LostPhase, kRatePiece> x) const;

 private:
  void find_mean();
  void find_records();
  void find_taper();
  void find_line(PhaseRecord& record);
  void find_weighted_sums(const PhaseRecord& record);
  /// Calls visit(position in the record, rate − mean; NaN if missing) for the rates of a record in a piece.
  template <class Visit>
  void walk(const PhaseRecord& record, std::size_t piece, Visit&& visit) const;
  /// Calls visit(position in the record, element) for the elements of a record in a piece, except that after the last
  /// rate; returns the sums after them.
  template <class Visit>
  LostPhase walk_weighted(const PhaseRecord& record, std::size_t piece, Visit&& visit) const;

  const RateSource& rate_;
  double mean_ = 0;
  std::vector<PhaseRecord> records_;
  std::vector<double> sums_;              ///< at the first position of a piece, and at the end
  std::vector<LostPhase> weighted_sums_;  ///< the same, if a value is missing
  std::size_t values_ = 0, missing_ = 0, gaps_ = 0, runs_ = 0, longest_run_ = 0, taper_ = 1;
};

}  // namespace prism::evaluation
