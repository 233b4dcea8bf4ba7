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

/// Finds the records of a series, and computes pieces of their phase: with the same result, however it is divided. The
/// mean of the series is subtracted from the rates, because the Allan deviation does not depend on it; the sums stay
/// small and precise. A missing value adds 0. In a record with missing values the line is subtracted as well: a missing
/// value then does not move the centre of a ramp.
///
/// Memory: 16 bytes per kRatePiece rates and 8 bytes per missing value.
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

  /// The pieces of the series that have elements of a record's phase, which are at the positions of the rates, from
  /// record.begin to record.begin + record.values.
  static std::size_t piece_of(std::size_t position) { return position / kRatePiece; }
  /// Writes the phase at the positions of a piece to `x`, at position − piece · kRatePiece; leaves other elements.
  void read(const PhaseRecord& record, std::size_t piece, std::span<double, kRatePiece> x) const;

 private:
  /// At the first position of a piece.
  struct Sums {
    double plain = 0, residual = 0;
  };
  void find_mean();
  void find_records();
  void find_line(PhaseRecord& record);
  /// Calls visit(position in the record, sums before it, value; NaN if missing) for the rates of a record in a piece.
  template <class Visit>
  Sums walk(const PhaseRecord& record, std::size_t piece, Visit&& visit) const;

  const RateSource& rate_;
  double mean_ = 0;
  std::vector<PhaseRecord> records_;
  std::vector<Sums> sums_;  ///< one per piece, and one for the end
  std::size_t values_ = 0, missing_ = 0, gaps_ = 0, runs_ = 0, longest_run_ = 0;
};

}  // namespace prism::evaluation
