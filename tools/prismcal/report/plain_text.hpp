// SPDX-License-Identifier: MIT
// A table as aligned text for a terminal.
#pragma once

#include <string>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// Title, columns with units, rows, caption; every line ends with a newline. Widths count characters, not bytes.
std::string plain_text(const Table& table);

}  // namespace prism::report
