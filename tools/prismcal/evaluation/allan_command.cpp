// SPDX-License-Identifier: MIT
#include "tools/prismcal/evaluation/allan_command.hpp"

#include <fmt/format.h>

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <map>
#include <memory>

#include "tools/number_check.hpp"
#include "tools/prismcal/evaluation/allan_text.hpp"

namespace prism {
namespace {

struct Choice {
  std::string file;
  RateSeriesChoice series;
  double interval_s = 0;
  AllanGrid grid = AllanGrid::kOctave;
  AllanEstimator estimator = AllanEstimator::kOverlapping;
  double probability = 0.683;
  bool json = false;
};

int run(const Choice& choice) {
  RateSeriesChoice wanted = choice.series;
  if (choice.interval_s > 0) wanted.interval_s = choice.interval_s;
  const auto series = read_rate_series(choice.file, wanted);
  const auto analysis = series.and_then([&](const RateSeries& s) {
    return analyse_allan(s, choice.grid, choice.estimator, choice.probability, choice.file);
  });
  if (!analysis) {
    fmt::print(stderr, "prismcal: {}\n", analysis.error().text());
    return 1;
  }
  fmt::print("{}",
             choice.json ? allan_json(*analysis, *series, choice.file) : allan_text(*analysis, *series, choice.file));
  return 0;
}

}  // namespace

void add_allan_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("allan", "Allan deviation of a recorded rate, with confidence and coefficients");
  const auto choice = std::make_shared<Choice>();
  const std::map<std::string, AllanGrid> grids = {
      {"octave", AllanGrid::kOctave}, {"decade", AllanGrid::kDecade}, {"dense", AllanGrid::kDense}};
  const std::map<std::string, AllanEstimator> estimators = {{"overlapping", AllanEstimator::kOverlapping},
                                                            {"non-overlapping", AllanEstimator::kNonOverlapping}};
  command->add_option("file", choice->file, "CSV: prismd's log, or any table of evenly spaced rates")->required();
  command->add_option("--column", choice->series.column,
                      "the rate: a column's name, or its number from 1 (default: rate_deg_per_h)");
  command->add_option("--unit", choice->series.unit,
                      "deg/h, deg/s, rad/s or arcsec/s (default: by the column's name, else deg/h)");
  command->add_option("--time", choice->series.time_column,
                      "the time in seconds: name or number (default: time_s or t_s)");
  command->add_option("--interval", choice->interval_s, "seconds between rows, where the file has no time")
      ->check(positive());
  command->add_option("--grid", choice->grid, "averaging times: octave, decade (1, 2, 4, 10, …) or dense")
      ->transform(CLI::CheckedTransformer(grids));
  command->add_option("--estimator", choice->estimator, "overlapping or non-overlapping")
      ->transform(CLI::CheckedTransformer(estimators));
  command->add_option("--confidence", choice->probability, "probability of the intervals, 0.5 to 0.999 (default 0.683)")
      ->check(within(0.5, 0.999));
  command->add_flag("--json", choice->json, "print JSON");
  command->callback([choice, &code] { code = run(*choice); });
}

}  // namespace prism
