// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/second_series.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "compensation/sample.hpp"

namespace prism::recordings {
namespace {

constexpr double kPerUnit = 1e6;
constexpr double kLargest = 9e15;  // exact in a double

/// The rate as an integer of 1e-6; nullopt if that is not exactly the rate. The quotient is rounded once, as the digits
/// of a log are when they are read.
std::optional<std::int64_t> as_integer(double rate) {
  const double scaled = std::round(rate * kPerUnit);
  if (!(std::fabs(scaled) < kLargest)) return std::nullopt;
  const auto integer = static_cast<std::int64_t>(scaled);
  const double back = static_cast<double>(integer) / kPerUnit;
  return std::bit_cast<std::uint64_t>(back) == std::bit_cast<std::uint64_t>(rate) ? std::optional(integer)
                                                                                  : std::nullopt;
}

}  // namespace

std::uint64_t SecondSeries::Block::integer(std::size_t i) const {
  const std::size_t at = i * bits, word = at / 64, shift = at % 64;
  std::uint64_t value = words[word] >> shift;
  if (shift + bits > 64) value |= words[word + 1] << (64 - shift);
  return bits == 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

// The largest integer of `bits` bits is kUnknown.
double SecondSeries::value(const Block& block, std::size_t i) {
  const std::uint64_t integer = block.integer(i);
  if (block.bits == 64) return std::bit_cast<double>(integer);
  if (integer == (std::uint64_t{1} << block.bits) - 1) return kUnknown;
  return static_cast<double>(block.base + static_cast<std::int64_t>(integer)) / kPerUnit;
}

SecondSeries::Block SecondSeries::packed(const std::vector<double>& rates) {
  Block block;
  std::int64_t low = INT64_MAX, high = INT64_MIN;
  bool fits = true;
  for (const double rate : rates) {
    if (std::isnan(rate)) continue;
    const auto integer = as_integer(rate);
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
  block.words.assign((rates.size() * block.bits + 63) / 64, 0);
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const std::uint64_t unknown = (std::uint64_t{1} << (block.bits % 64)) - 1;
    const std::uint64_t integer = !fits                  ? std::bit_cast<std::uint64_t>(rates[i])
                                  : std::isnan(rates[i]) ? unknown
                                                         : static_cast<std::uint64_t>(*as_integer(rates[i]) - low);
    const std::size_t at = i * block.bits, word = at / 64, shift = at % 64;
    block.words[word] |= integer << shift;
    if (shift + block.bits > 64) block.words[word + 1] |= integer >> (64 - shift);
  }
  return block;
}

void SecondSeries::push(std::int64_t second, double rate) {
  if (runs_.empty() || second != last_second() + 1) runs_.push_back({second, size_});
  open_.push_back(rate);
  ++size_;
  if (open_.size() < kBlock) return;
  blocks_.push_back(packed(open_));
  open_.clear();
}

std::int64_t SecondSeries::last_second() const {
  return runs_.back().second + static_cast<std::int64_t>(size_ - 1 - runs_.back().index);
}

double SecondSeries::rate(std::size_t index) const {
  const std::size_t block = index / kBlock, i = index % kBlock;
  return block < blocks_.size() ? value(blocks_[block], i) : open_[i];
}

std::int64_t SecondSeries::second(std::size_t index) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), index,
                                      [](std::size_t wanted, const Run& run) { return wanted < run.index; });
  const Run& run = *(after - 1);
  return run.second + static_cast<std::int64_t>(index - run.index);
}

std::optional<std::size_t> SecondSeries::find(std::int64_t second) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), second,
                                      [](std::int64_t wanted, const Run& run) { return wanted < run.second; });
  if (after == runs_.begin()) return std::nullopt;
  const Run& run = *(after - 1);
  const std::size_t index = run.index + static_cast<std::size_t>(second - run.second);
  return index < (after == runs_.end() ? size_ : after->index) ? std::optional(index) : std::nullopt;
}

void SecondSeries::decode(std::size_t block, std::vector<double>& rates) const {
  if (block >= blocks_.size()) {
    rates = open_;
    return;
  }
  rates.resize(kBlock);
  for (std::size_t i = 0; i < kBlock; ++i) rates[i] = value(blocks_[block], i);
}

}  // namespace prism::recordings
