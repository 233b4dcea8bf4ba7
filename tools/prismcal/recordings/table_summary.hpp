// SPDX-License-Identifier: MIT
// How a table was understood, for `prismcal inspect`: range, holes and course of each column, and its time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/recordings/sample_grid.hpp"
#include "tools/prismcal/tables/plain_table.hpp"

namespace prism::recordings {

struct ColumnSummary {
  tables::Header header;
  tables::ColumnKind kind = tables::ColumnKind::kText;
  double smallest = 0, largest = 0;  ///< kUnknown without a number; as in the file
  std::size_t missing = 0;
  std::vector<double> course;  ///< at most 64 means of equal numbers of rows, in order; kUnknown without a value
};

struct TimeSummary {
  std::string column, format;
  std::int64_t first_ns = 0, last_ns = 0;
  bool is_date = false;  ///< ns since 1970 UTC; otherwise since the origin of the file
  std::optional<SampleGrid> grid;
  std::string no_grid;  ///< why sample_grid() found no sample time
};

struct TableSummary {
  std::string form, command;  ///< command: train_command()
  bool states_rate = false;   ///< the command is complete but for the site
  std::size_t rows = 0, torn = 0;
  std::vector<ColumnSummary> columns;
  std::optional<TimeSummary> time;
  std::vector<std::string> remarks;  ///< findings of a training with the columns that the table names, one line each
  std::string problem;               ///< of the time, or of the first bad row: the summary ends there; empty: none
};

/// Errors: those of PlainTable::open().
Result<TableSummary> summarise_table(const std::string& path, const tables::TableOptions& options);

}  // namespace prism::recordings
