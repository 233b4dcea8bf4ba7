// SPDX-License-Identifier: MIT
// Writes the report as CSV and JSON, and a table as text for a terminal.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/document.hpp"

namespace prism::report {

/// The first page as "# cover,NAME,VALUE", facts as "# fact,NAME,VALUE", then for each table a line "# table,ID,TITLE",
/// the column line ("name [unit]"), the rows and an empty line. Quotes fields if needed (RFC 4180).
std::string csv_text(const Report& report);
/// One table: the column line and the rows, for pandas.read_csv and Excel.
std::string csv_text(const Table& table);
/// One file per table: (ID.csv, text).
std::vector<std::pair<std::string, std::string>> csv_files(const Report& report);

/// {"title":…,"simulated":…,"cover":{…},"facts":{…},"tables":{ID:{"title":…,"columns":[…],"rows":[[{"text":…,"value":…}…]…]}…}}.
/// "figures" has each curve of each panel:
/// {ID:{"panels":[{"x":LABEL,"y":LABEL,"curves":[{"name":…,"x":[…],"y":[…]}…]}…]}…}; a gap is null. The "value" of a
/// cell is the number with all digits, "text" that of HTML and CSV; an unknown number has no "value".
std::string json_text(const Report& report);

/// Title, columns with units, rows, caption; each line ends with a newline. Column widths count characters, not bytes.
std::string plain_text(const Table& table);
/// The warning, then all tables and paragraphs, and the meaning of each figure.
std::string plain_text(const Report& report);

}  // namespace prism::report
