// SPDX-License-Identifier: MIT
#include "tools/prismctl/screen/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/prismctl/screen/styled_text.hpp"

namespace prism::screen {
namespace {

constexpr int kDotColumns = 2, kDotRows = 4;
constexpr double kNeighbourS = 2.5;  ///< rows nearer than this are joined

/// Joins the curve across at most `most` empty columns, which occur if a column is shorter than one second.
void join(std::vector<double>& columns, std::size_t most) {
  std::size_t last = columns.size();  // last column with a value
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!std::isfinite(columns[i])) continue;
    for (std::size_t hole = last + 1; i - last <= most && hole < i; ++hole) {
      const double share = static_cast<double>(hole - last) / static_cast<double>(i - last);
      columns[hole] = columns[last] + share * (columns[i] - columns[last]);
    }
    last = i;
  }
}

/// Index of a cell, row by row.
std::size_t cell_at(const ChartFrame& frame, int row, int column) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.columns) + static_cast<std::size_t>(column);
}

/// Mean of the values in each dot column.
std::vector<double> column_means(const std::deque<TracePoint>& points, double TracePoint::*value,
                                 const ChartFrame& frame) {
  const auto columns = static_cast<std::size_t>(frame.columns) * kDotColumns;
  const double width_s = (frame.end_s - frame.begin_s) / static_cast<double>(columns);
  if (!(width_s > 0))
    return std::vector<double>(columns, NAN);  // time too large: begin + span == begin in floating point
  std::vector<double> sums(columns), counts(columns);
  for (const TracePoint& point : points) {
    const double place = (point.time_s - frame.begin_s) / width_s;
    if (!std::isfinite(point.*value) || !(place >= 0) || point.time_s > frame.end_s) continue;
    const std::size_t column = std::min(static_cast<std::size_t>(place), columns - 1);
    sums[column] += point.*value;
    counts[column] += 1;
  }
  for (std::size_t i = 0; i < columns; ++i) sums[i] /= counts[i];  // 0 / 0 = NaN: a gap
  join(sums, static_cast<std::size_t>(kNeighbourS / width_s));
  return sums;
}

// Unicode braille: dots 1-3 and 7 in the left column, 4-6 and 8 in the right one.
std::string braille(unsigned dots) {
  const unsigned code = 0x2800 + dots;
  return {static_cast<char>(0xE0 | code >> 12), static_cast<char>(0x80 | (code >> 6 & 0x3F)),
          static_cast<char>(0x80 | (code & 0x3F))};
}

unsigned braille_bit(int column, int row) {
  constexpr unsigned kBits[2][4] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
  return kBits[column][row];
}

// As many decimals as fit.
std::string scale_text(double value) {
  constexpr int kColumns = kScaleColumns - 2;
  for (int decimals = 5; decimals >= 0; --decimals) {
    std::string text = fmt::format("{:>{}.{}f}", value, kColumns, decimals);
    if (text.size() == kColumns) return text;
  }
  return fmt::format("{:>{}.2e}", value, kColumns);
}

std::string ago(double seconds) {
  return seconds >= 3600 ? fmt::format("-{:g} h", seconds / 3600)
         : seconds >= 60 ? fmt::format("-{:g} min", seconds / 60)
                         : fmt::format("-{:g} s", seconds);
}

}  // namespace

Bounds bounds_of(const std::deque<TracePoint>& points, double TracePoint::*value, const ChartFrame& frame) {
  Bounds settled, all;
  const auto widen = [](Bounds& bounds, double to) {
    bounds = bounds.known ? Bounds{std::min(bounds.low, to), std::max(bounds.high, to), true} : Bounds{to, to, true};
  };
  for (const TracePoint& point : points) {
    if (!std::isfinite(point.*value) || point.time_s < frame.begin_s || point.time_s > frame.end_s) continue;
    widen(all, point.*value);
    if (point.settled) widen(settled, point.*value);
  }
  return settled.known ? settled : all;
}

Bounds widened(Bounds bounds, double span) {
  const double middle = (bounds.low + bounds.high) / 2;
  const double half = std::max(bounds.high - bounds.low, span) / 2;
  return {middle - half, middle + half, bounds.known};
}

std::vector<std::string> chart(const std::deque<TracePoint>& points, double TracePoint::*value, const Bounds& bounds,
                               const ChartFrame& frame) {
  constexpr double kLeastSpan = 2e-5;  // resolution of the scale's digits
  const Bounds scale = widened(bounds, kLeastSpan);
  const std::vector<double> means = column_means(points, value, frame);
  std::vector<unsigned> cells(static_cast<std::size_t>(frame.columns * frame.rows));
  const int dot_rows = frame.rows * kDotRows;
  for (int i = 0; i < static_cast<int>(means.size()); ++i) {
    const double mean = means[static_cast<std::size_t>(i)];
    if (!std::isfinite(mean)) continue;
    const double depth = (scale.high - mean) / (scale.high - scale.low) * (dot_rows - 1);
    const int dot = static_cast<int>(std::lround(std::clamp(depth, 0.0, dot_rows - 1.0)));
    cells[cell_at(frame, dot / kDotRows, i / kDotColumns)] |= braille_bit(i % kDotColumns, dot % kDotRows);
  }
  std::vector<std::string> lines;
  for (int row = 0; row < frame.rows; ++row) {
    const bool named = scale.known && (row == 0 || row == frame.rows - 1);
    std::string line = named ? scale_text(row == 0 ? scale.high : scale.low) : std::string(kScaleColumns - 2, ' ');
    line += frame.utf8 ? " │" : " |";
    for (int column = 0; column < frame.columns; ++column) {
      const unsigned dots = cells[cell_at(frame, row, column)];
      line += frame.utf8 ? braille(dots) : std::string(dots ? "*" : " ");
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

std::string time_axis(const ChartFrame& frame, const std::string& end) {
  const int marks = frame.columns >= 100 ? 4 : 2;
  std::string axis(static_cast<std::size_t>(kScaleColumns + frame.columns), ' ');
  const auto put = [&](const std::string& label, int column) {
    const int last = static_cast<int>(axis.size() - label.size());
    axis.replace(static_cast<std::size_t>(std::clamp(column, 0, std::max(last, 0))), label.size(), label);
  };
  for (int mark = 0; mark < marks; ++mark) {
    const double share = static_cast<double>(mark) / marks;
    const std::string label = ago((1 - share) * (frame.end_s - frame.begin_s));
    const int centred = mark == 0 ? 0 : static_cast<int>(label.size()) / 2;
    put(label, kScaleColumns + static_cast<int>(share * frame.columns) - centred);
  }
  put(end, kScaleColumns + frame.columns);
  return axis.substr(0, kScaleColumns + static_cast<std::size_t>(frame.columns));
}

}  // namespace prism::screen
