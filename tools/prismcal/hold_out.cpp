// SPDX-License-Identifier: MIT
#include "tools/prismcal/hold_out.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "base/text_number.hpp"

namespace prism::recordings {
namespace {

constexpr std::string_view kSegments = "blocks:";

enum class Side { kTraining, kHeldOut, kNeither };

/// The side of the block [begin, end) of a recording of this length; times are s since its start.
Side side_of(const HoldOut& hold_out, std::int64_t gap_s, std::int64_t length_s, std::int64_t begin, std::int64_t end) {
  if (hold_out.segment_s == 0) {
    const double border = (1 - hold_out.share) * static_cast<double>(length_s);
    if (static_cast<double>(end) <= border) return Side::kTraining;
    return static_cast<double>(begin - gap_s) >= border ? Side::kHeldOut : Side::kNeither;
  }
  const std::int64_t segment = begin / hold_out.segment_s, from = segment * hold_out.segment_s,
                     to = from + hold_out.segment_s;
  if (segment % 2 == 0) return end <= to ? Side::kTraining : Side::kNeither;
  return begin >= from + gap_s && end <= to - gap_s ? Side::kHeldOut : Side::kNeither;
}

BlockTable part_of(const BlockTable& table, const std::vector<Side>& sides, Side wanted) {
  BlockTable part;
  part.name = table.name;
  part.features = table.features;
  part.earth_rate_deg_per_h = table.earth_rate_deg_per_h;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (sides[i] != wanted) continue;
    part.blocks.push_back(table.blocks[i]);
    part.bias_deg_per_h.push_back(table.bias_deg_per_h[i]);
    part.follows.push_back(i > 0 && sides[i - 1] == wanted && table.follows[i]);
  }
  std::size_t block = 0;
  for_each_known(table.seconds, [&](std::int64_t second, double rate) {
    while (block < part.size() && part.second(block) < second) ++block;
    if (block < part.size() && second > part.second(block) - table.features.length_s)
      append(part.seconds, second, rate);
  });
  return part;
}

}  // namespace

std::string HoldOut::text() const {
  return segment_s > 0 ? fmt::format("every second {} s", segment_s) : fmt::format("the last {:g} %", 100 * share);
}

Result<HoldOut> parse_hold_out(const std::string& text) {
  const bool segments = text.starts_with(kSegments);
  const auto parsed = parse_number<double>(std::string_view(text).substr(segments ? kSegments.size() : 0));
  const double number = parsed.value_or(0);
  if (segments && number >= 1 && number <= 1e7 && number == std::floor(number))
    return HoldOut{0, static_cast<std::int64_t>(number)};
  if (!segments && number >= 0.05 && number <= 0.95) return HoldOut{number, 0};
  return make_error("--hold-out",
                    fmt::format("found \"{}\", expected a share from 0.05 to 0.95, or blocks:SECONDS", text));
}

Result<Split> split_blocks(const BlockTable& table, const HoldOut& hold_out) {
  const std::int64_t gap_s = table.features.length_s, shortest_s = 3 * gap_s;
  if (hold_out.segment_s > 0 && hold_out.segment_s < shortest_s) {
    return make_error("--hold-out", fmt::format("found segments of {} s, expected {} s or more: held-out and training "
                                                "blocks must be {} s apart",
                                                hold_out.segment_s, shortest_s, gap_s));
  }
  std::vector<Side> sides;
  const std::int64_t begin = table.second(0) - table.features.length_s;
  const std::int64_t length_s = table.second(table.size() - 1) - begin;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::int64_t end = table.second(i) - begin;
    sides.push_back(side_of(hold_out, gap_s, length_s, end - table.features.length_s, end));
  }
  Split split{part_of(table, sides, Side::kTraining), part_of(table, sides, Side::kHeldOut), 0};
  split.between = table.size() - split.training.size() - split.held_out.size();
  if (split.training.size() < 2 || split.held_out.size() < 2) {
    return make_error(table.name, fmt::format("found {} training and {} held-out blocks, expected two or more of each",
                                              split.training.size(), split.held_out.size()));
  }
  return split;
}

}  // namespace prism::recordings
