// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/packed_stamps.hpp"

#include <bit>

namespace prism::recordings {

PackedStamps::Block::Block(const std::vector<std::int64_t>& stamps) : base(static_cast<std::uint64_t>(stamps.front())) {
  const auto span = static_cast<std::int64_t>(static_cast<std::uint64_t>(stamps.back()) - base);
  step = static_cast<std::uint64_t>(span / static_cast<std::int64_t>(stamps.size() - 1));
  const auto difference = [&](std::size_t i) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(stamps[i]) - base - step * i);
  };
  std::int64_t low = 0, high = 0;
  for (std::size_t i = 0; i < stamps.size(); ++i)
    low = std::min(low, difference(i)), high = std::max(high, difference(i));
  const auto least = static_cast<std::uint64_t>(low);
  differences =
      PackedBits(stamps.size(), static_cast<unsigned>(std::bit_width(static_cast<std::uint64_t>(high) - least)));
  for (std::size_t i = 0; i < stamps.size(); ++i) differences.set(i, static_cast<std::uint64_t>(difference(i)) - least);
  base += least;
}

void PackedStamps::push(std::int64_t stamp) {
  open_.push_back(stamp);
  if (open_.size() < kBlock) return;
  blocks_.emplace_back(open_);
  open_.clear();
}

}  // namespace prism::recordings
