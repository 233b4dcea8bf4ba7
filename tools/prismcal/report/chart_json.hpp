// SPDX-License-Identifier: MIT
// A figure as JSON for an interactive chart, in addition to its SVG.
#pragma once

#include <string>

#include "tools/prismcal/report/plot.hpp"

namespace prism::report {

/// Whether a chart shows what the drawing does. Not a surface, nor its mark; not a curve that goes back (a chart's rows
/// are in the order of x); nothing on a logarithmic axis that is not above zero; no panel without a point.
bool can_be_charted(const Plot& plot);

/// {"columns", "height", "panels": [{"title", "x", "y", "right": {"label", "log", "min", "max"}, "series": [{"name",
/// "form", "colour", "width", "dash", "right", "x", "y", "high"}]}]}; numbers with seven digits as they are drawn, null
/// where a curve breaks. It can stand in a page's script element: there is no '<' in it.
std::string chart_json(const Plot& plot);

/// The script that draws the charts: Debian's dygraphs, tools/charts and report/page, joined when prismcal is built.
extern const char* const kChartScript;
/// "sha256-…" of it, for the page's policy.
extern const char* const kChartScriptHash;

}  // namespace prism::report
