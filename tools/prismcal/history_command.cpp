// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "base/escape.hpp"
#include "base/text_number.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/log_folder.hpp"
#include "tools/prismcal/progress_bars.hpp"

namespace prism::commands {
namespace {

struct HistoryChoice {
  std::string log, axis;
};

/// Rows with one model, in the order of the log.
struct Period {
  std::string model;  ///< id and name, or "none"
  std::int64_t first_s, last_s = 0;
  std::size_t rows = 0;
};

Result<int> history(const HistoryChoice& choice) {
  auto folder = recordings::LogFolder::open(choice.log, choice.axis);
  if (!folder) return tl::unexpected<Error>(folder.error());
  std::vector<Period> periods;
  tables::ReadMeter meter(read_progress(), folder->bytes());
  for (recordings::LogSegment& segment : folder->segments) {
    std::int64_t last_s = 0;
    const auto at = [&](const recordings::LogRow& row) -> Result<void> {
      last_s = row.second_mean.second;
      return {};
    };
    if (auto done = recordings::read_log_segment(segment, at, meter); !done) return tl::unexpected<Error>(done.error());
    if (segment.rows == 0) continue;
    const std::string model = segment.value("model");
    if (periods.empty() || periods.back().model != model) periods.push_back({model, *segment.first_second});
    periods.back().last_s = last_s;
    periods.back().rows += segment.rows;
  }
  end_progress();
  for (const Period& period : periods) {
    const std::size_t space = std::min(period.model.find(' '), period.model.size());  // after the id
    fmt::print("{} to {}  {:>9} rows  {}{}\n", utc_text(period.first_s), utc_text(period.last_s), period.rows,
               printable(period.model.substr(0, std::min<std::size_t>(space, 12))),
               printable(period.model.substr(space)));
  }
  return 0;
}

}  // namespace

void add_history_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("history", "which model corrected the rows of a log, and when");
  const auto choice = std::make_shared<HistoryChoice>();
  command->add_option("log", choice->log, "prismd's log: a file or a folder")->required();
  command->add_option("--axis", choice->axis, "axis of a log of several");
  tools::add_examples(*command, {"prismcal history /var/log/prismd/gyro1"});
  command->callback([choice, &code] { code = exit_code(history(*choice)); });
}

}  // namespace prism::commands
