// SPDX-License-Identifier: MIT
// Statements of the user about a table of another program; everything else is detected.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "tools/prismcal/tables/read_meter.hpp"

namespace prism::tables {

struct TableOptions {
  std::string separator;          ///< comma, semicolon, tab, blank, bar, none, or the character; empty: detected
  std::string decimal;            ///< "." or ","; empty: detected
  std::string encoding;           ///< a name that iconv knows; empty: detected
  std::optional<int> header_row;  ///< line of the names, from 1; 0: the file has none
  std::string time_format;        ///< see kTimeFormats; empty: detected
  std::string time_unit;  ///< s, ms, us, ns, min, h or d of a time that is a number; empty: by the header or detected
  double interval_s = 0;  ///< > 0: true spacing of the rows, from which the unit of the time follows
  /// Called once per file that was read, with one line of how it was understood. May be empty.
  std::function<void(const std::string&)> announce;
  ReadProgress progress;  ///< while files are read: tables, logs and captures

  /// No remarks and no progress: --quiet.
  void silence() {
    announce = {};
    progress = {};
  }
};

}  // namespace prism::tables
