// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "base/plain_text.hpp"
#include "tools/prismcal/recordings/table_summary.hpp"
#include "tools/prismcal/verification/checks.hpp"

namespace prism::verification {

Finding check_table(const std::string& path) {
  const auto summary = recordings::summarise_table(path, {});
  if (!summary) return {path, FileState::kUnreadable, without_path(summary.error(), path)};
  std::size_t holes = 0;
  for (const recordings::ColumnSummary& column : summary->columns) holes += column.holes;
  std::string text =
      fmt::format("table of another program: {}; {}, {}, {}", summary->dialect, counted(summary->rows, "row"),
                  counted(summary->columns.size(), "column"), counted(holes, "hole"));
  if (summary->time && summary->time->grid)
    text += fmt::format("; every {:.6g} s, {} lost", summary->time->grid->interval_s,
                        counted(summary->time->grid->lost, "sample"));
  if (!summary->problem.empty()) return {path, FileState::kDamaged, text + "; " + summary->problem};
  if (summary->torn > 0) return {path, FileState::kTruncated, text + "; the last row has no line end"};
  return {path, FileState::kIntact, text};
}

}  // namespace prism::verification
