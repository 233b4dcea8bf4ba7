// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <utility>

#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/allan_text.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/option_table.hpp"
#include "tools/prismcal/commands/recording_options.hpp"

namespace prism::commands {
namespace {

struct AllanChoice {
  std::string file;
  recordings::RateSeriesChoice series;
  std::string grid;
  bool json = false, quiet = false;
};

int run(const AllanChoice& choice) {
  recordings::RateSeriesChoice wanted = choice.series;
  if (choice.quiet) wanted.table.silence();
  auto series = recordings::read_rate_series(choice.file, wanted);
  if (!series) return failed(series.error());
  const auto analysis = evaluation::analyse_allan(
      std::move(series->rate_deg_per_h), series->interval_s,
      choice.grid == "decade" ? evaluation::AllanGrid::kDecade : evaluation::AllanGrid::kOctave, choice.file);
  if (!analysis) return failed(analysis.error());
  for (const std::string& note : series->notes)
    if (!choice.quiet) fmt::print(stderr, "{}: {}\n", choice.file, note);
  fmt::print("{}", choice.json ? analysis::allan_json(*analysis, *series, choice.file)
                               : analysis::allan_text(*analysis, *series, choice.file));
  return 0;
}

}  // namespace

void add_allan_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("allan", "Allan deviation of a recorded rate, with confidence and coefficients");
  const auto choice = std::make_shared<AllanChoice>();
  add_options(*command, {{"file", &choice->file, "prismd's log (file or folder), or any table of evenly spaced rates"}},
              Need::kRequired);
  add_options(
      *command,
      {{"--column", &choice->series.column, "rate column: its name or number from 1 (default: rate_deg_per_h)"},
       {"--axis", &choice->series.axis, "axis to use, if the log has several"},
       {"--unit", &choice->series.unit, "deg/h, deg/s, rad/s or arcsec/s (default: by the column's header)"},
       {"--time", &choice->series.time_column, "time column: its name or number (default: by name and unit)"},
       {"--interval", &choice->series.interval_s, "seconds between rows, if the file has no time", tools::positive()}});
  add_table_options(*command, choice->series.table);
  add_options(*command, {{"--grid", &choice->grid, "averaging times: octave or decade (1, 2, 4, 10, …)",
                          one_of({"octave", "decade"})},
                         {"--json", &choice->json, "print JSON"},
                         {"--quiet", &choice->quiet, "no remarks on stderr"}});
  tools::add_examples(*command,
                      {"prismcal allan logs/", "prismcal allan table.csv --column rate_x_dps --grid decade --json",
                       "prismcal allan rates.txt --interval 0.01 --unit deg/s"});
  command->callback([choice, &code] { code = run(*choice); });
}

}  // namespace prism::commands
