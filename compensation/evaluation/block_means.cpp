// SPDX-License-Identifier: MIT
#include "compensation/evaluation/block_means.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::evaluation {
namespace {

/// One segment of blocks between gaps. Block number k covers (start + k·length, start + (k + 1)·length].
class BlockRun {
 public:
  BlockRun(BlockMeans& result, double row_s, double length_s) : result_(result), row_s_(row_s), length_s_(length_s) {}

  void begin(double start_s) {
    start_s_ = start_s;
    block_ = 0;
    last_kept_ = -1;
  }

  void add(const TimedValue& row) {
    // Half a row of tolerance: a block ends with the row that ends at its edge, regardless of rounded times.
    const auto block = static_cast<long long>(std::floor((row.time_s - start_s_ - 0.5 * row_s_) / length_s_));
    if (block != block_) close();
    block_ = block;
    offset_sum_ += row.value - (count_ == 0 ? (origin_ = row.value) : origin_);
    ++count_;
  }

  void close() {
    const bool full = static_cast<double>(count_) * row_s_ >= 0.5 * length_s_;
    if (count_ > 0 && full) {
      result_.time_s.push_back(start_s_ + static_cast<double>(block_ + 1) * length_s_);
      result_.mean.push_back(origin_ + offset_sum_ / static_cast<double>(count_));
      result_.follows.push_back(last_kept_ >= 0 && last_kept_ == block_ - 1);
      result_.rows += count_;
      last_kept_ = block_;
    } else {
      result_.rows_left += count_;
    }
    count_ = 0;
    offset_sum_ = 0;
  }

  /// The last block of a segment counts only if the segment reaches the block's end.
  void finish(double last_time_s) {
    const double end_s = start_s_ + static_cast<double>(block_ + 1) * length_s_;
    if (last_time_s < end_s - 0.75 * row_s_) {
      result_.rows_left += count_;
      count_ = 0;
      offset_sum_ = 0;
    }
    close();
  }

 private:
  BlockMeans& result_;
  double row_s_, length_s_;
  double start_s_ = 0;
  long long block_ = 0, last_kept_ = -1;
  std::size_t count_ = 0;
  double origin_ = 0, offset_sum_ = 0;  // sums of differences from the first value keep the precision
};

}  // namespace

Result<BlockMeans> mean_over_blocks(std::span<const TimedValue> rows, double row_s, double length_s, double max_gap_s,
                                    const std::string& where) {
  if (!(row_s > 0) || !(length_s >= row_s)) {
    return make_error(where,
                      fmt::format("found blocks of {} s and rows of {} s, expected 0 < row <= block", length_s, row_s));
  }
  BlockMeans result;
  result.length_s = length_s;
  BlockRun run(result, row_s, length_s);
  double last_s = 0;
  bool begun = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const TimedValue& row = rows[i];
    if (!std::isfinite(row.time_s) || (i > 0 && !(row.time_s > rows[i - 1].time_s))) {
      return make_error(where, fmt::format("time of row {} is not after that of the row before", i));
    }
    if (!std::isfinite(row.value)) {
      ++result.rows_unknown;
      continue;
    }
    const double gap_s = begun ? row.time_s - last_s - row_s : 0;
    if (begun && gap_s > max_gap_s) {
      ++result.gaps;
      result.longest_gap_s = std::max(result.longest_gap_s, gap_s);
      run.finish(last_s);
    }
    if (!begun || gap_s > max_gap_s) run.begin(row.time_s - row_s);
    run.add(row);
    begun = true;
    last_s = row.time_s;
  }
  if (!begun) return make_error(where, fmt::format("found no value in {} rows, expected at least one", rows.size()));
  run.finish(last_s);
  return result;
}

}  // namespace prism::evaluation
