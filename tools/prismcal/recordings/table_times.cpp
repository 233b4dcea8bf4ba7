// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/table_times.hpp"

#include <fmt/format.h>

#include "base/plain_text.hpp"
#include "base/text_number.hpp"

namespace prism::recordings {

std::string time_text(std::int64_t time_ns, bool is_date) {
  if (!is_date) return fmt::format("{:.9g} s", static_cast<double>(time_ns) / 1e9);
  std::string text = utc_nano_text(time_ns);
  text.pop_back();  // Z
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text + "Z";
}

Result<void> append_times(PackedStamps& stamps_ns, const tables::TableSource& table, const tables::Block& block) {
  const bool is_date = table.time() && table.time()->has_date;
  std::int64_t before = stamps_ns.empty() ? INT64_MIN : stamps_ns.back();
  for (std::size_t i = 0; i < block.time_ns.size(); before = block.time_ns[i++]) {
    if (block.time_ns[i] >= before) continue;
    return make_error(fmt::format("{}:{}", table.path(), block.lines[i]),
                      fmt::format("found time {} after {}, expected increasing times",
                                  time_text(block.time_ns[i], is_date), time_text(before, is_date)));
  }
  stamps_ns.push(block.time_ns);
  return {};
}

std::vector<std::string> grid_notes(const SampleGrid& grid, std::size_t rows) {
  std::vector<std::string> notes;
  if (!grid.remark.empty()) notes.push_back("time: " + grid.remark);
  if (grid.lost == 0) return notes;
  notes.push_back(fmt::format("{} lost in {}", counted(grid.lost, "sample"), counted(grid.holes.size(), "hole")));
  if (grid.lost > rows)
    notes.back() += fmt::format(
        ", more than the {}: are there two recordings, or day and month in another order "
        "(--time-format)?",
        counted(rows, "row"));
  return notes;
}

}  // namespace prism::recordings
