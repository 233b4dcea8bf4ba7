// SPDX-License-Identifier: MIT
// Writes the report as one self-contained HTML page.
#pragma once

#include <string>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// Numbers tables and figures in order. Escapes all texts of `report`. Replaces an id that is not [a-z0-9_-] by
/// "section-3", "table-7" or "figure-2".
std::string html_page(const Report& report);

}  // namespace prism::report
