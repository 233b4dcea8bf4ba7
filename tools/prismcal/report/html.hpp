// SPDX-License-Identifier: MIT
// The report as one HTML page that needs nothing else: styles and figures are in it.
#pragma once

#include <functional>
#include <string>

#include "base/result.hpp"
#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// The look of the page, on screen and on paper.
extern const char* const kStyle;

/// Draws a figure: draw_svg() in the program, something quicker in tests.
using Draw = std::function<Result<std::string>(const Plot& plot, const std::string& name)>;

/// Tables and figures are numbered in their order. A figure that cannot be drawn refuses the page.
Result<std::string> html_page(const Report& report, const Draw& draw);

/// `text` with &, <, > and quotes made safe for HTML.
std::string html_escaped(const std::string& text);

}  // namespace prism::report
