// SPDX-License-Identifier: MIT
// Writes the report as one self-contained HTML page, and prints a page.
#pragma once

#include <string>

#include "base/result.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::report {

/// Numbers tables and figures in order. Escapes all texts of `report`. Replaces an id that is not [a-z0-9_-] by
/// "section-3", "table-7" or "figure-2".
std::string html_page(const Report& report);

/// Prints a page to a PDF file with Chromium. Errors: it is not installed, or fails; `path` cannot be written.
Result<void> print_pdf(const std::string& html, const std::string& path);

}  // namespace prism::report
