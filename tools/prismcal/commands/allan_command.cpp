// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <map>
#include <memory>
#include <utility>

#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/allan_text.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/recording_options.hpp"

namespace prism::commands {
namespace {

struct AllanChoice {
  std::string file;
  recordings::RateSeriesChoice series;
  double interval_s = 0;
  evaluation::AllanGrid grid = evaluation::AllanGrid::kOctave;
  bool json = false, quiet = false;
};

int run(const AllanChoice& choice) {
  recordings::RateSeriesChoice wanted = choice.series;
  if (choice.interval_s > 0) wanted.interval_s = choice.interval_s;
  if (choice.quiet) wanted.table.silence();
  auto series = recordings::read_rate_series(choice.file, wanted);
  if (!series) return failed(series.error());
  const auto analysis =
      evaluation::analyse_allan(std::move(series->rate_deg_per_h), series->interval_s, choice.grid, choice.file);
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
  const std::map<std::string, evaluation::AllanGrid> grids = {{"octave", evaluation::AllanGrid::kOctave},
                                                              {"decade", evaluation::AllanGrid::kDecade}};
  command->add_option("file", choice->file, "prismd's log (file or folder), or any table of evenly spaced rates")
      ->required();
  command->add_option("--column", choice->series.column,
                      "rate column: its name or number from 1 (default: rate_deg_per_h)");
  command->add_option("--axis", choice->series.axis, "axis to use, if the log has several");
  command->add_option("--unit", choice->series.unit,
                      "deg/h, deg/s, rad/s or arcsec/s (default: by the column's header)");
  command->add_option("--time", choice->series.time_column,
                      "time column: its name or number (default: by name and unit)");
  command->add_option("--interval", choice->interval_s, "seconds between rows, if the file has no time")
      ->check(tools::positive());
  add_table_options(*command, choice->series.table);
  command->add_option("--grid", choice->grid, "averaging times: octave or decade (1, 2, 4, 10, …)")
      ->transform(CLI::CheckedTransformer(grids));
  command->add_flag("--json", choice->json, "print JSON");
  command->add_flag("--quiet", choice->quiet, "no remarks on stderr");
  tools::add_examples(*command,
                      {"prismcal allan logs/", "prismcal allan table.csv --column rate_x_dps --grid decade --json",
                       "prismcal allan rates.txt --interval 0.01 --unit deg/s"});
  command->callback([choice, &code] { code = run(*choice); });
}

}  // namespace prism::commands
