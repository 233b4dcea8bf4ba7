// SPDX-License-Identifier: MIT
// The report as one HTML page that needs nothing else: styles and figures are in it.
#pragma once

#include <string>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// The look of the page, on screen and on paper.
extern const char* const kStyle;

/// Tables and figures are numbered in their order. Every text of `report` is plain text in the page; an id that is not
/// [a-z0-9_-] becomes "section-3", "table-7" or "figure-2".
std::string html_page(const Report& report);

}  // namespace prism::report
