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

/// Gathers the 1 Hz series and counts what is missing in it.
class Seconds {
 public:
  explicit Seconds(BlockTable& table) : table_(table) {}

  void add(const compensation::Bucket& bucket) {
    if (begun_) fill_hole(bucket.second - last_ - 1);
    const bool known = std::isfinite(bucket.rate_deg_per_h);
    if (!known) miss(1);
    push(bucket.second, known ? bucket.rate_deg_per_h - table_.earth_rate_deg_per_h : kUnknown);
    in_hole_ = !known;
    table_.missing_frames += bucket.missing_frames;
    last_ = bucket.second;
    begun_ = true;
  }

  bool comes_before(std::int64_t second) const { return !begun_ || last_ < second; }

 private:
  /// An Allan deviation must see a hole; one of days says no more than one of a minute.
  void fill_hole(std::int64_t hole_s) {
    if (hole_s <= 0) return;
    miss(static_cast<std::size_t>(hole_s));
    for (std::int64_t i = 1; i <= std::min<std::int64_t>(hole_s, 60); ++i) push(last_ + i, kUnknown);
    in_hole_ = true;
  }

  void miss(std::size_t seconds) {
    table_.missing_s += seconds;
    if (!in_hole_) ++table_.gaps;
    in_hole_ = true;
  }

  void push(std::int64_t second, double bias) {
    table_.second.push_back(second);
    table_.second_bias_deg_per_h.push_back(bias);
  }

  BlockTable& table_;
  std::int64_t last_ = 0;
  bool begun_ = false, in_hole_ = false;
};

/// Lays sessions one behind the other.
class Timeline {
 public:
  explicit Timeline(std::span<const std::size_t> sessions) : sessions_(sessions) {}

  /// Call with each index in turn.
  bool begins(std::size_t index) {
    const bool begins = next_ < sessions_.size() && sessions_[next_] == index;
    if (begins) ++next_;
    fresh_ = fresh_ || begins;
    return begins;
  }
  compensation::Bucket laid(compensation::Bucket bucket) {
    if (std::exchange(fresh_, false)) {
      constexpr std::int64_t kHole = 1;  // what was there between two sessions is not known
      shift_s_ = bucket.second <= last_ ? last_ + 1 + kHole - bucket.second : 0;
    }
    bucket.second += shift_s_;
    last_ = bucket.second;
    return bucket;
  }

 private:
  std::span<const std::size_t> sessions_;
  std::size_t next_ = 0;
  bool fresh_ = false;
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
    values.push_back(static_cast<double>(block.bucket.second - blocks.front().bucket.second + features.length_s) /
                     3600);
  }
  return values;
}

Result<BlockTable> make_block_table(std::span<const compensation::Bucket> buckets,
                                    const compensation::FeatureDefinition& features, double earth_rate_deg_per_h,
                                    const std::string& name, std::span<const std::size_t> sessions) {
  BlockTable table;
  table.name = name;
  table.features = features;
  table.earth_rate_deg_per_h = earth_rate_deg_per_h;
  compensation::Conditioner conditioner(features);
  Seconds seconds(table);
  std::int64_t next_end = 0;
  bool on_grid = false;  // the grid begins anew after every gap
  Timeline timeline(sessions);
  for (std::size_t i = 0; i < buckets.size(); ++i) {
    if (timeline.begins(i)) conditioner.reset();
    if (buckets[i].partial) continue;
    const compensation::Bucket bucket = timeline.laid(buckets[i]);
    if (!seconds.comes_before(bucket.second)) {
      return refuse(name, fmt::format("second {} does not come after the one before it", bucket.second));
    }
    seconds.add(compensation::believed(bucket));
    const compensation::Window window = conditioner.push(bucket);
    if (window.state != compensation::WindowState::kReady) {
      table.warming.push_back(window);
      on_grid = false;
      continue;
    }
    if (on_grid && bucket.second < next_end) continue;
    if (!std::isfinite(window.rate_deg_per_h)) continue;
    table.follows.push_back(on_grid && bucket.second == next_end);
    table.blocks.push_back(window);
    table.bias_deg_per_h.push_back(window.rate_deg_per_h - earth_rate_deg_per_h);
    next_end = bucket.second + features.length_s;
    on_grid = true;
  }
  if (table.blocks.empty()) {
    return refuse(
        name,
        fmt::format("{} in {} hold no full block; a block needs {} s without a gap", counted(buckets.size(), "second"),
                    counted(table.gaps + (buckets.empty() ? 0 : 1), "piece"), compensation::history_s(features)));
  }
  return table;
}

}  // namespace prism::recordings
