// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/packed_series.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "compensation/sample.hpp"

namespace prism::recordings {
namespace {

constexpr double kPerUnit = 1e6;
constexpr double kLargest = 9e15;  // exact in a double

/// The value as an integer of 1e-6; nullopt if that is not exactly the value. The quotient is rounded once, as the
/// digits of a log are when they are read.
std::optional<std::int64_t> as_integer(double value) {
  const double scaled = std::round(value * kPerUnit);
  if (!(std::fabs(scaled) < kLargest)) return std::nullopt;
  const auto integer = static_cast<std::int64_t>(scaled);
  const double back = static_cast<double>(integer) / kPerUnit;
  return std::bit_cast<std::uint64_t>(back) == std::bit_cast<std::uint64_t>(value) ? std::optional(integer)
                                                                                   : std::nullopt;
}

}  // namespace

// The largest integer of `bits` bits is kUnknown.
PackedSeries::Block PackedSeries::packed(const std::vector<double>& values) {
  Block block;
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  bool fits = true;
  for (const double value : values) {
    if (std::isnan(value)) continue;
    const auto integer = as_integer(value);
    fits = fits && integer;
    if (!fits) break;
    low = std::min(low, *integer), high = std::max(high, *integer);
  }
  if (low > high) low = high = 0;
  if (fits) {
    block.base = low;
    block.bits = static_cast<unsigned>(std::bit_width(static_cast<std::uint64_t>(high - low) + 1));
    fits = block.bits < 60;
  }
  if (!fits) block.bits = 64;
  block.words.assign((values.size() * block.bits + 63) / 64 + (fits ? 1 : 0), 0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::uint64_t unknown = (std::uint64_t{1} << (block.bits % 64)) - 1;
    const std::uint64_t integer = !fits                   ? std::bit_cast<std::uint64_t>(values[i])
                                  : std::isnan(values[i]) ? unknown
                                                          : static_cast<std::uint64_t>(*as_integer(values[i]) - low);
    const std::size_t at = i * block.bits, word = at / 64, shift = at % 64;
    block.words[word] |= integer << shift;
    if (shift + block.bits > 64) block.words[word + 1] |= integer >> (64 - shift);
  }
  return block;
}

void PackedSeries::unpack(const Block& block, std::size_t first, std::span<double> values) {
  if (block.bits == 64) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::bit_cast<double>(block.words[first + i]);
    return;
  }
  const std::uint64_t unknown = (std::uint64_t{1} << block.bits) - 1;
  std::size_t at = first * block.bits;
  for (double& value : values) {
    const std::size_t word = at / 64, shift = at % 64;
    // In two steps: a shift by 64 is undefined.
    const std::uint64_t high = block.words[word + 1] << 1 << (63 - shift);
    const std::uint64_t integer = (block.words[word] >> shift | high) & unknown;
    const double number = static_cast<double>(block.base + static_cast<std::int64_t>(integer)) / kPerUnit;
    value = integer == unknown ? kUnknown : number;
    at += block.bits;
  }
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
      std::copy_n(open_.begin() + static_cast<std::ptrdiff_t>(begin), part.size(), part.begin());
    }
    done += part.size();
  }
}

evaluation::RateSource PackedSeries::source() const {
  return {size_, [this](std::size_t first, std::span<double> values) { read(first, values); }};
}

}  // namespace prism::recordings
