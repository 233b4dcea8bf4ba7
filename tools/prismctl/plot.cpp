// SPDX-License-Identifier: MIT
#include "tools/prismctl/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace prism::prismctl {
namespace {

constexpr int kDotColumns = 2, kDotRows = 4;

struct Bounds {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
};

// Newest values, squeezed into one mean per dot column.
std::vector<double> columns_of(const std::vector<double>& values, int columns) {
  const std::size_t per_column = std::max<std::size_t>(1, (values.size() + columns - 1) / columns);
  std::vector<double> means;
  for (std::size_t begin = 0; begin < values.size(); begin += per_column) {
    double sum = 0;
    int count = 0;
    for (std::size_t i = begin; i < std::min(values.size(), begin + per_column); ++i) {
      if (std::isfinite(values[i])) sum += values[i], ++count;
    }
    means.push_back(count > 0 ? sum / count : std::nan(""));
  }
  return means;
}

std::string utf8(unsigned code) {
  return {static_cast<char>(0xE0 | code >> 12), static_cast<char>(0x80 | (code >> 6 & 0x3F)),
          static_cast<char>(0x80 | (code & 0x3F))};
}

// Unicode braille: dots 1-3 and 7 in the left column, 4-6 and 8 in the right one.
std::string braille(unsigned dots) { return utf8(0x2800 + dots); }
unsigned braille_bit(int column, int row) {
  constexpr unsigned kBits[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
  return kBits[column][row];
}

}  // namespace

std::vector<std::string> plot(const std::vector<double>& values, const PlotSize& size) {
  const std::vector<double> means = columns_of(values, size.columns * kDotColumns);
  Bounds bounds;
  for (const double value : means) {
    if (!std::isfinite(value)) continue;
    bounds.low = std::min(bounds.low, value);
    bounds.high = std::max(bounds.high, value);
  }
  const bool empty = bounds.low > bounds.high;
  if (empty) bounds = {0, 0};
  const double middle = (bounds.low + bounds.high) / 2;
  const double half = std::max((bounds.high - bounds.low) / 2, 1e-6 + 1e-9 * std::fabs(middle));
  std::vector<unsigned> cells(static_cast<std::size_t>(size.columns * size.rows));
  const int dot_rows = size.rows * kDotRows;
  const int offset = size.columns * kDotColumns - static_cast<int>(means.size());
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (!std::isfinite(means[i])) continue;
    const double height = (means[i] - middle) / (2 * half) + 0.5;
    const int dot = std::clamp(static_cast<int>((1 - height) * dot_rows), 0, dot_rows - 1);
    const int column = offset + static_cast<int>(i);
    cells[static_cast<std::size_t>(dot / kDotRows * size.columns + column / kDotColumns)] |=
        braille_bit(column % kDotColumns, dot % kDotRows);
  }
  std::vector<std::string> lines;
  for (int row = 0; row < size.rows; ++row) {
    const bool top = row == 0, bottom = row == size.rows - 1;
    std::string line = empty    ? std::string(11, ' ')
                       : top    ? fmt::format("{:>10.5f} ", middle + half)
                       : bottom ? fmt::format("{:>10.5f} ", middle - half)
                                : std::string(11, ' ');
    line += size.utf8 ? "│" : "|";
    for (int column = 0; column < size.columns; ++column) {
      const unsigned dots = cells[static_cast<std::size_t>(row * size.columns + column)];
      line += size.utf8 ? braille(dots) : std::string(dots ? "*" : " ");
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace prism::prismctl
