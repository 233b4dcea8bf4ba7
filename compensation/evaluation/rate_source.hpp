// SPDX-License-Identifier: MIT
// A series of rates that is read in pieces, any number of times: it may be packed, or computed when it is read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace prism::evaluation {

struct RateSource {
  std::size_t size = 0;
  /// Reads the rates from `first` on into all of `rates`; first + rates.size() <= size. Fast for a `first` that is a
  /// multiple of kRatePiece, and as many rates.
  std::function<void(std::size_t first, std::span<double> rates)> read;
};

inline constexpr std::size_t kRatePiece = 4096;

/// Calls visit(index, rate) for each rate in order.
template <class Visit>
void for_each_rate(const RateSource& source, Visit&& visit) {
  double piece[kRatePiece];
  for (std::size_t begin = 0; begin < source.size; begin += kRatePiece) {
    const std::size_t count = std::min(kRatePiece, source.size - begin);
    source.read(begin, std::span(piece, count));
    for (std::size_t i = 0; i < count; ++i) visit(begin + i, piece[i]);
  }
}

/// All rates, with room for one more.
inline std::vector<double> column(const RateSource& source) {
  std::vector<double> rates;
  rates.reserve(source.size + 1);
  for_each_rate(source, [&](std::size_t, double rate) { rates.push_back(rate); });
  return rates;
}

}  // namespace prism::evaluation
