// SPDX-License-Identifier: MIT
// The same report without a page: CSV for spreadsheets, JSON for programs, a table for a terminal.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/prismcal/report/document.hpp"

namespace prism::report {

/// All tables, one after the other: a line "# table,ID,TITLE", the column line ("name [unit]"), the rows, an empty
/// line. The header facts stand in front as "# fact,NAME,VALUE". Fields are quoted where they must be (RFC 4180).
std::string csv_text(const Report& report);
/// One table alone: the column line and the rows, as pandas.read_csv and Excel take it.
std::string csv_text(const Table& table);
/// Every table as a file of its own: ID.csv and its text.
std::vector<std::pair<std::string, std::string>> csv_files(const Report& report);

/// {"title":…,"simulated":…,"facts":{…},"tables":{ID:{"title":…,"columns":[…],"rows":[[{"text":…,"value":…}…]…]}…}}.
/// "figures" has each curve of each panel:
/// {ID:{"panels":[{"x":LABEL,"y":LABEL,"curves":[{"name":…,"x":[…],"y":[…]}…]}…]}…}, null where it breaks. A cell's
/// "value" is the number with all its digits, "text" what HTML and CSV show; no number: no "value".
std::string json_text(const Report& report);

/// Title, columns with units, rows, caption; every line ends with a newline. Widths count characters, not bytes.
std::string plain_text(const Table& table);

}  // namespace prism::report
