// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/log_folder.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::commands {
namespace {

struct AllanChoice {
  std::string file;
  recordings::RateSeriesChoice series;
  CommonOptions report;
};

report::Report allan_report(const evaluation::AllanAnalysis& analysis, const Result<evaluation::Spectrum>& spectrum,
                            const recordings::RateSeries& series, const std::string& where) {
  report::Report report;
  report.title =
      "Allan deviation of gyro " + (series.gyro_serial.empty() ? "without a serial number" : series.gyro_serial);
  report.subtitle = where;
  report.tool = std::string("prismcal ") + kVersion;
  report.warning = analysis::unexplained_text(analysis);
  if (!analysis.coefficients) report.warning += "No coefficients: " + analysis.coefficients.error().text();
  std::string data = fmt::format("{}: {} values of {}, every {:g} s ({}), {}", where, analysis.values, series.column,
                                 analysis.tau0_s, series.interval_source, counted(analysis.holes, "gap"));
  if (analysis.missing > 0) data += fmt::format(" of {}", counted(analysis.missing, "value"));
  report.facts = {{"data", data}};
  report::Figure figure{
      "allan_curve", "Allan deviation and power spectral density", analysis::kNoiseCaption,
      analysis::noise_plot({{"", report::Ink::kCorrected, &analysis, spectrum ? &*spectrum : nullptr}}),
      spectrum ? analysis::lines_text(*spectrum) : spectrum.error().text()};
  report::Table points{"points", "Allan deviation at each averaging time", "Overlapping; intervals of 68 %.",
                       report::columns("tau [s] | deviation [deg/h] | low [deg/h] | high [deg/h] | largest noise:")};
  for (const evaluation::AllanPoint& p : analysis.points)
    points.rows.push_back({report::general_cell(p.tau_s, 6), report::general_cell(p.deviation, 7),
                           report::general_cell(p.low, 7), report::general_cell(p.high, 7),
                           evaluation::noise_type_text(p.noise)});
  report.sections = {
      {"conclusion", "Conclusion", {report::Paragraph{data + "."}, analysis::noise_parameters_table(analysis)}},
      {"curves", "Curves", {std::move(figure), std::move(points)}}};
  return report;
}

/// First and last page: dates, statements and files.
Result<void> complete(report::Report& report, const AllanChoice& choice, const recordings::RateSeries& series,
                      double length_s) {
  const auto test = test_statement(choice.report);
  if (!test) return tl::unexpected(test.error());
  std::error_code error;
  const bool folder = std::filesystem::is_directory(choice.file, error);
  // A segment that cannot be read is left out of a log, and said to be: only that file's line is affected.
  for (const std::string& path : folder ? recordings::files_of(choice.file, ".csv") : std::vector{choice.file})
    report.facts.emplace_back("file",
                              fmt::format("{} (SHA-256 {})", path, sha256_of_file(path).value_or("unknown: not read")));
  for (const std::string& note : series.notes) report.facts.emplace_back("left out", note);
  fill_cover(report, {{"gyro", series.gyro_serial}, {"recordings", dates_text(choice.file, series.begin_s, length_s)}},
             *test);
  return {};
}

Result<int> allan(const AllanChoice& choice) {
  recordings::RateSeriesChoice wanted = choice.series;
  if (choice.report.quiet) wanted.table.silence();
  auto series = recordings::read_rate_series(choice.file, wanted);
  if (!series) return tl::unexpected(series.error());
  const double length_s = static_cast<double>(series->rate_deg_per_h.size()) * series->interval_s;
  const auto spectrum = evaluation::power_spectrum(series->rate_deg_per_h, series->interval_s, choice.file);
  const auto analysis = evaluation::analyse_allan(std::move(series->rate_deg_per_h), series->interval_s, choice.file);
  if (!analysis) return tl::unexpected(analysis.error());
  for (const std::string& note : series->notes)
    if (!choice.report.quiet) fmt::print(stderr, "{}: {}\n", choice.file, note);
  report::Report report = allan_report(*analysis, spectrum, *series, choice.file);
  if (!choice.report.json) fmt::print("{}", report::plain_text(report));
  if (!choice.report.json && !wants_report(choice.report)) return 0;
  if (auto done = complete(report, choice, *series, length_s); !done) return tl::unexpected(done.error());
  if (auto done = write_report(report, choice.report); !done) return tl::unexpected(done.error());
  return 0;
}

}  // namespace

void add_allan_command(CLI::App& app, int& code) {
  const auto [command, choice] = new_command<AllanChoice>(
      app, code, "allan", "Allan deviation of a recorded rate, with confidence and coefficients", allan);
  add_options(command, {{"file", &choice.file, "prismd's log (file or folder), or any table of evenly spaced rates"}},
              Need::kRequired);
  add_options(command,
              {{"--column", &choice.series.column, "rate column: its name or number from 1 (default: rate_deg_per_h)"},
               {"--axis", &choice.series.axis, "axis to use, if the log has several"},
               {"--unit", &choice.series.unit, "deg/h, deg/s, rad/s or arcsec/s (default: by the column's header)"},
               {"--time", &choice.series.time_column, "time column: its name or number (default: by name and unit)"},
               {"--interval", &choice.series.table.interval_s, "seconds between rows, if the file has no time",
                tools::positive()}});
  add_table_options(command, choice.series.table);
  add_options(command, {{"--json", &choice.report.json, "print JSON"},
                        {"--quiet", &choice.report.quiet, "no remarks on stderr"}});
  add_report_options(command, choice.report);
  tools::add_examples(command,
                      {"prismcal allan logs/ --out report", "prismcal allan table.csv --column rate_x_dps --json",
                       "prismcal allan rates.txt --interval 0.01 --unit deg/s"});
}

}  // namespace prism::commands
