// SPDX-License-Identifier: MIT
// The times of a table's rows: read block by block, and as texts for messages.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismcal/recordings/sample_grid.hpp"
#include "tools/prismcal/tables/table_source.hpp"

namespace prism::recordings {

/// A time in a message: "2026-11-23T09:11:00.5Z", or "7001.5 s" without a date.
std::string time_text(std::int64_t time_ns, bool is_date);

/// Appends the times of a block of the table. Errors: a time before the one above it, with file and line.
Result<void> append_times(PackedStamps& stamps_ns, const tables::TableSource& table, const tables::Block& block);

/// Remarks on the sample time and the lost samples of a table with as many rows.
std::vector<std::string> grid_notes(const SampleGrid& grid, std::size_t rows);

}  // namespace prism::recordings
