// SPDX-License-Identifier: MIT
// A report of any length in a page of a few megabytes.
#pragma once

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// Returns the report with its long series and tables reduced; others are unchanged. A line becomes its mean, with a
/// band from minimum to maximum, of each of kIntervals intervals of x. Points are thinned to one per cell of a grid, at
/// most kMostPoints. Of a table kMostRows rows remain, or a few less: the first, those with the smallest and the
/// largest value of a column, and others at equal distances. The captions state it. A reduced report stays as it is.
Report reduced(Report report);
/// The same for one of its parts.
Block reduced(Block block);

inline constexpr std::size_t kIntervals = 400, kMostPoints = 700, kMostRows = 400;
/// Series with fewer points, and tables with fewer rows, are unchanged.
inline constexpr std::size_t kLongSeries = 1200;

}  // namespace prism::report
