// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/packed_series.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "compensation/sample.hpp"

namespace prism::recordings {
namespace {

constexpr double kLargest = 9e15;  // exact in a double

/// The value as an integer of 1 / per_unit; nullopt if that is not exactly the value. The quotient is rounded once, as
/// the digits of a table are when they are read.
std::optional<std::int64_t> as_integer(double value, double per_unit) {
  const double scaled = std::round(value * per_unit);
  if (!(std::fabs(scaled) < kLargest)) return std::nullopt;
  const auto integer = static_cast<std::int64_t>(scaled);
  const double back = static_cast<double>(integer) / per_unit;
  return std::bit_cast<std::uint64_t>(back) == std::bit_cast<std::uint64_t>(value) ? std::optional(integer)
                                                                                   : std::nullopt;
}

/// Values as integers, their smallest and largest one. kUnknown has none.
struct Integers {
  std::array<std::int64_t, evaluation::kRatePiece> all;
  std::int64_t low = INT64_MAX, high = INT64_MIN;

  /// Returns false if one of the values is not exactly an integer.
  bool set(const std::vector<double>& values, double per_unit) {
    low = INT64_MAX, high = INT64_MIN;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(values[i])) continue;
      const auto integer = as_integer(values[i], per_unit);
      if (!integer) return false;
      all[i] = *integer;
      low = std::min(low, *integer), high = std::max(high, *integer);
    }
    if (low > high) low = high = 0;
    return bits() < 60;
  }
  /// Enough for the range and one more integer.
  unsigned bits() const { return static_cast<unsigned>(std::bit_width(static_cast<std::uint64_t>(high - low) + 1)); }
};

}  // namespace

// The largest integer is kUnknown.
PackedSeries::Block PackedSeries::packed(const std::vector<double>& values) {
  Integers integers;
  Block block;
  for (const double per_unit : {1e6, 1e9}) {
    if (!integers.set(values, per_unit)) continue;
    block.per_unit = per_unit;
    block.base = integers.low;
    block.numbers = PackedBits(values.size(), integers.bits());
    for (std::size_t i = 0; i < values.size(); ++i)
      block.numbers.set(i, std::isnan(values[i]) ? block.numbers.largest()
                                                 : static_cast<std::uint64_t>(integers.all[i] - block.base));
    return block;
  }
  block.numbers = PackedBits(values.size(), 64);
  for (std::size_t i = 0; i < values.size(); ++i) block.numbers.set(i, std::bit_cast<std::uint64_t>(values[i]));
  return block;
}

void PackedSeries::unpack(const Block& block, std::size_t first, std::span<double> values) const {
  if (block.per_unit == 0) {
    for (double& value : values) value = std::bit_cast<double>(block.numbers[first++]) * factor_;
    return;
  }
  for (double& value : values) {
    const std::uint64_t integer = block.numbers[first++];
    const double number = static_cast<double>(block.base + static_cast<std::int64_t>(integer)) / block.per_unit;
    value = integer == block.numbers.largest() ? kUnknown : number * factor_;
  }
}

void PackedSeries::drop_before(std::size_t index) {
  for (; dropped_ < std::min(index / kBlock, blocks_.size()); ++dropped_) blocks_[dropped_] = {};
}

void PackedSeries::push(double value) {
  open_.push_back(value);
  ++size_;
  if (open_.size() < kBlock) return;
  blocks_.push_back(packed(open_));
  open_.clear();
}

double PackedSeries::operator[](std::size_t index) const {
  double value = kUnknown;
  read(index, std::span(&value, 1));
  return value;
}

void PackedSeries::read(std::size_t first, std::span<double> values) const {
  for (std::size_t done = 0; done < values.size();) {
    const std::size_t block = (first + done) / kBlock, begin = (first + done) % kBlock;
    const auto part = values.subspan(done, std::min(values.size() - done, kBlock - begin));
    if (block < blocks_.size()) {
      unpack(blocks_[block], begin, part);
    } else {
      for (std::size_t i = 0; i < part.size(); ++i) part[i] = open_[begin + i] * factor_;
    }
    done += part.size();
  }
}

evaluation::RateSource PackedSeries::source() const {
  return {size_, [this](std::size_t first, std::span<double> values) { read(first, values); }};
}

}  // namespace prism::recordings
