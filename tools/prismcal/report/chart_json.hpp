// SPDX-License-Identifier: MIT
// Writes a figure as JSON for an interactive chart, in addition to its SVG.
#pragma once

#include <string>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Returns true if a chart can show the same as the SVG. Not possible: surfaces and marks, curves with decreasing x
/// (the rows of a chart are sorted by x), values ≤ 0 or bars on a logarithmic axis, panels without a point.
bool can_be_charted(const Plot& plot);

/// {"columns", "height", "panels": [{"title", "x", "y", "right": {"label", "log", "min", "max"}, "series": [{"name",
/// "form", "colour", "width", "dash", "right", "x", "y", "high"}]}]}. Numbers have seven digits; a gap is null.
/// Contains no
/// '<', so that it can be embedded in a script element.
std::string chart_json(const Plot& plot);

/// The script that draws the charts: Debian's dygraphs, tools/charts and report/page, joined at build time.
extern const char* const kChartScript;
/// "sha256-…" of kChartScript, for the Content-Security-Policy of the page.
extern const char* const kChartScriptHash;

}  // namespace prism::report
