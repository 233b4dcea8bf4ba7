// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/block_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/plain_text.hpp"

namespace prism::recordings {
namespace {

/// Builds the 1 Hz series and counts missing seconds and gaps.
class Seconds {
 public:
  explicit Seconds(BlockTable& table) : table_(table) {}

  void add(const compensation::SecondMean& second_mean) {
    if (begun_) fill_gap(second_mean.second - last_ - 1);
    const bool known = std::isfinite(second_mean.rate_deg_per_h);
    if (!known) miss(1);
    push(second_mean.second, known ? second_mean.rate_deg_per_h - table_.earth_rate_deg_per_h : kUnknown);
    in_gap_ = !known;
    table_.missing_frames += second_mean.missing_frames;
    last_ = second_mean.second;
    begun_ = true;
  }

  bool precedes(std::int64_t second) const { return !begun_ || last_ < second; }

 private:
  /// Marks a gap in the series for the Allan deviation; 60 s are enough for any length.
  void fill_gap(std::int64_t gap_s) {
    if (gap_s <= 0) return;
    miss(static_cast<std::size_t>(gap_s));
    for (std::int64_t i = 1; i <= std::min<std::int64_t>(gap_s, 60); ++i) push(last_ + i, kUnknown);
    in_gap_ = true;
  }

  void miss(std::size_t seconds) {
    table_.missing_s += seconds;
    if (!in_gap_) ++table_.gaps;
    in_gap_ = true;
  }

  void push(std::int64_t second, double bias) {
    table_.second.push_back(second);
    table_.second_bias_deg_per_h.push_back(bias);
  }

  BlockTable& table_;
  std::int64_t last_ = 0;
  bool begun_ = false, in_gap_ = false;
};

/// Shifts sessions that overlap in time, so that they follow each other.
class Timeline {
 public:
  explicit Timeline(std::span<const std::size_t> sessions) : sessions_(sessions) {}

  /// Returns true if a session begins at `index`. Call with each index in order.
  bool begins(std::size_t index) {
    const bool begins = next_ < sessions_.size() && sessions_[next_] == index;
    if (begins) ++next_;
    session_begins_ = session_begins_ || begins;
    return begins;
  }
  compensation::SecondMean shifted(compensation::SecondMean second_mean) {
    if (std::exchange(session_begins_, false)) {
      constexpr std::int64_t kGap = 1;  // the real time between two sessions is unknown
      shift_s_ = second_mean.second <= last_ ? last_ + 1 + kGap - second_mean.second : 0;
    }
    second_mean.second += shift_s_;
    last_ = second_mean.second;
    return second_mean;
  }

 private:
  std::span<const std::size_t> sessions_;
  std::size_t next_ = 0;
  bool session_begins_ = false;
  std::int64_t last_ = INT64_MIN, shift_s_ = 0;
};

}  // namespace

std::vector<double> BlockTable::column(const std::string& input) const {
  std::vector<double> values;
  values.reserve(blocks.size());
  for (const compensation::Window& block : blocks) values.push_back(compensation::input_value(block, features, input));
  return values;
}

std::vector<double> BlockTable::hours() const {
  std::vector<double> values;
  values.reserve(blocks.size());
  for (const compensation::Window& block : blocks) {
    values.push_back(
        static_cast<double>(block.second_mean.second - blocks.front().second_mean.second + features.length_s) / 3600);
  }
  return values;
}

Result<BlockTable> make_block_table(std::span<const compensation::SecondMean> second_means,
                                    const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                    const std::string& name, std::span<const std::size_t> sessions) {
  BlockTable table;
  table.name = name;
  table.features = features;
  table.earth_rate_deg_per_h = earth_rate_deg_per_h;
  compensation::FeatureExtractor extractor(features);
  Seconds seconds(table);
  std::int64_t next_end = 0;
  bool on_grid = false;  // the grid restarts after each gap
  Timeline timeline(sessions);
  for (std::size_t i = 0; i < second_means.size(); ++i) {
    if (timeline.begins(i)) extractor.reset();
    if (second_means[i].partial) continue;
    const compensation::SecondMean second_mean = timeline.shifted(second_means[i]);
    if (!seconds.precedes(second_mean.second)) {
      return make_error(name, fmt::format("found second {} out of order", second_mean.second));
    }
    seconds.add(compensation::without_implausible(second_mean));
    const compensation::Window window = extractor.push(second_mean);
    if (window.state != compensation::WindowState::kReady) {
      table.warming.push_back(window);
      on_grid = false;
      continue;
    }
    if (on_grid && second_mean.second < next_end) continue;
    if (!std::isfinite(window.rate_deg_per_h)) continue;
    table.follows.push_back(on_grid && second_mean.second == next_end);
    table.blocks.push_back(window);
    table.bias_deg_per_h.push_back(window.rate_deg_per_h - earth_rate_deg_per_h);
    next_end = second_mean.second + features.length_s;
    on_grid = true;
  }
  if (table.blocks.empty()) {
    return make_error(name, fmt::format("found {} in {}, expected {} s without a gap for a block",
                                        counted(second_means.size(), "second"),
                                        counted(table.gaps + (second_means.empty() ? 0 : 1), "segment"),
                                        compensation::history_s(features)));
  }
  return table;
}

}  // namespace prism::recordings
