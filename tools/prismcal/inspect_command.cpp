// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/sample.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/model_evaluation.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/series.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {
namespace {

using nlohmann::ordered_json;

/// The findings of a training with the columns that the table names, which are read again, but for those on the time;
/// the reason if it cannot use them.
std::vector<std::string> remarks_on(const tables::PlainTable& table, const tables::TableOptions& options) {
  recordings::SourceOptions source;
  source.table = options;
  source.table.silence();
  source.map = recordings::suggested_map(table, options);
  std::erase_if(source.map, [](const std::string& entry) { return entry.ends_with(":UNIT"); });
  const auto is_time = [](const std::string& entry) { return entry.starts_with("time="); };
  if (options.interval_s == 0 && std::ranges::none_of(source.map, is_time)) return {};
  const auto ignore = [](const auto&...) { return Result<void>(); };
  auto recording = recordings::read_recording(table.path(), source, ignore);
  if (!recording) return {recording.error().what};
  std::erase_if(recording->findings,
                [](const recordings::Finding& finding) { return finding.kind == "time"; });  // summary_of() has them
  std::vector<std::string> remarks = recording->remarks();
  for (std::string& question : recording->questions()) remarks.push_back(std::move(question));
  return remarks;
}

/// How the table is understood, as --json prints it. `problem`: of the time, or of the first bad row, where the rest of
/// the summary ends; empty: none. Errors: those of PlainTable::open().
Result<ordered_json> summary_of(const std::string& path, const tables::TableOptions& options) {
  auto table = tables::PlainTable::open(path, options);
  if (!table) return tl::unexpected<Error>(table.error());
  ordered_json json = {{"file", path}, {"dialect", table->form_text()}, {"rows", 0}, {"torn_rows", 0}};
  json.update({{"columns", ordered_json::array()}, {"time", nullptr}, {"remarks", ordered_json::array()}});
  json.update({{"command", recordings::train_command(*table, options)}, {"problem", ""}});
  constexpr const char* kKinds[] = {"number", "time", "text"};  // in the order of ColumnKind
  tables::Selection selection;
  for (std::size_t i = 0; i < table->columns().size(); ++i) {
    const tables::Header& header = table->columns()[i];
    if (table->kind(i) == tables::ColumnKind::kNumber) selection.numbers.push_back(i);
    json["columns"].push_back({{"header", header.text}, {"name", header.name}, {"unit", nullptr}});
    if (header.unit) json["columns"].back()["unit"] = header.unit->name;
    json["columns"].back().update({{"kind", kKinds[static_cast<std::size_t>(table->kind(i))]},
                                   {"smallest", nullptr},
                                   {"largest", nullptr},
                                   {"holes", 0}});
  }
  const std::vector<std::size_t> numbers = selection.numbers;
  const auto time = table->time_column();
  if (time) selection.time = tables::TimeSelection{*time};
  if (auto good = table->select(selection); !good) {
    json["problem"] = good.error().text();
    selection.time.reset();
    if (good = table->select(selection); !good) return tl::unexpected<Error>(good.error());
  }
  std::vector<std::int64_t> stamps_ns;
  std::vector<double> smallest(numbers.size(), kUnknown), largest = smallest;
  tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) json["problem"] = more.error().text();
    if (!more || !*more) break;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      smallest[i] = std::fmin(smallest[i], row.values[i]);
      largest[i] = std::fmax(largest[i], row.values[i]);
    }
    if (table->time()) stamps_ns.push_back(row.time_ns);
  }
  for (std::size_t i = 0; i < numbers.size(); ++i)
    json["columns"][numbers[i]].update(
        {{"smallest", smallest[i]}, {"largest", largest[i]}, {"holes", table->missing(i)}});
  json["rows"] = table->rows();
  json["torn_rows"] = table->torn();
  if (!stamps_ns.empty()) {
    const auto text = [&](std::int64_t time_ns) { return tables::time_text(time_ns, table->has_dates()); };
    const auto grid = recordings::sample_grid(stamps_ns, path, options.interval_s);
    json["time"] = {{"column", table->columns()[*time].text},
                    {"format", table->time()->text()},
                    {"first", text(stamps_ns.front())},
                    {"last", text(stamps_ns.back())},
                    {"interval_s", nullptr},
                    {"lost", grid ? grid->lost : 0},
                    {"notes", grid ? grid->notes : std::vector{grid.error().what}}};
    if (grid) json["time"]["interval_s"] = grid->interval_s;
  }
  const bool good = json["problem"].get<std::string>().empty();
  if (good && recordings::rate_column(*table)) json["remarks"] = remarks_on(*table, options);
  return json;
}

/// The same as text.
void print(const ordered_json& summary) {
  const auto text = [](const ordered_json& object, const char* key) { return object[key].get<std::string>(); };
  report::Table columns{
      "columns",
      fmt::format("{}, {}{}", counted(summary["rows"], "row"), counted(summary["columns"].size(), "column"),
                  summary["torn_rows"] > 0 ? "; the last one has no line end and is left out" : ""),
      "", report::columns("column: | unit: | smallest | largest | holes")};
  for (const auto& column : summary["columns"]) {
    const auto number = [&](const char* key) {
      return column[key].is_null() ? std::nullopt : std::optional(column[key].get<double>());
    };
    const bool is_number = column["kind"] == "number";
    columns.rows.push_back({shortened(text(column, "header"), 40),
                            !is_number                 ? text(column, "kind")
                            : column["unit"].is_null() ? ""
                                                       : text(column, "unit"),
                            report::general_cell(number("smallest"), 8), report::general_cell(number("largest"), 8),
                            is_number ? report::count_cell(column["holes"]) : report::Cell(report::kNothing)});
  }
  fmt::print("{}: {}\n{}", text(summary, "file"), text(summary, "dialect"), report::plain_text(columns));
  if (const ordered_json& time = summary["time"]; !time.is_null()) {
    fmt::print("\ntime {} ({}): {} to {}\n", text(time, "column"), text(time, "format"), text(time, "first"),
               text(time, "last"));
    if (!time["interval_s"].is_null()) fmt::print("every {:.6g} s\n", time["interval_s"].get<double>());
    for (const auto& note : time["notes"]) fmt::print("{}\n", printable(note.get<std::string>()));
  }
  if (!summary["remarks"].empty()) fmt::print("\n");
  for (const auto& remark : summary["remarks"]) fmt::print("{}\n", printable(remark.get<std::string>()));
  if (!text(summary, "problem").empty()) return;
  const std::string command = text(summary, "command");
  if (command.find(":UNIT") != std::string::npos)
    fmt::print("\nReplace COLUMN (its name or number) and UNIT (deg/h, deg/s, …; degC, K or degF; V or mV):");
  fmt::print("\n{}\n{}\n", printable(command), recordings::kSiteAdvice);
}

Result<int> inspect(const std::string& file, const tables::TableOptions& options, bool json) {
  const auto kind = recordings::bytes_kind(file);
  if (!kind) return tl::unexpected<Error>(kind.error());
  if (!kind->empty())
    return make_error(file,
                      fmt::format("is a {}; prismd --sniff {} finds the frame description", *kind, shell_word(file)));
  auto summary = summary_of(file, options);
  if (!summary) return tl::unexpected<Error>(summary.error());
  const std::string problem = (*summary)["problem"];
  if (!json) {
    print(*summary);
    if (!problem.empty()) fmt::print(stderr, "prismcal: {}\n", problem);
  } else {
    std::string command = (*summary)["command"];
    if (command.find("rate=COLUMN:UNIT") != std::string::npos) (*summary)["command"] = "";  // it is not complete
    fmt::print("{}\n", json_text(*summary, 2));
  }
  return problem.empty() ? 0 : 1;
}

// Several recordings, a line each.

/// Reads the blocks as a training does; a table without --map by the names and units of its columns.
Result<recordings::Loaded> load(const std::string& path, const recordings::TrainingSetOptions& options) {
  recordings::SourceOptions source = options.source;
  source.table.silence();
  recordings::SiteOptions site = options.site;
  site.no_earth_rate = site.no_earth_rate || !site.latitude_deg;  // the verdict needs the site for unit and sign only
  const auto any = [](const recordings::Recording&) { return Result<void>(); };
  auto loaded = recordings::read_blocks(path, source, site, options.window(), any);
  if (loaded || !source.map.empty() || !std::filesystem::is_regular_file(path)) return loaded;
  const auto table = tables::PlainTable::open(path, source.table);
  if (!table) return loaded;
  source.map = recordings::suggested_map(*table, source.table);
  const auto is_open = [](const std::string& entry) {
    return entry.find("COLUMN") != std::string::npos || entry.ends_with(":UNIT");
  };
  if (source.map.empty() || std::ranges::any_of(source.map, is_open)) return loaded;
  return recordings::read_blocks(path, source, site, options.window(), any);
}

/// The mean step between samples, gaps included.
double step_of(const recordings::Recording& recording, const recordings::BlockTable& table) {
  std::size_t samples = 0;
  for (const auto& [count, seconds] : recording.samples) samples += count * seconds;
  return samples > 0 ? static_cast<double>(table.last_s - table.first_s + 1) / static_cast<double>(samples) : kUnknown;
}

constexpr std::array kVerdicts = {"good", "doubtful", "unusable"};

/// Length, step, temperatures, noise of the window's means, verdict and its reasons, of which the first decides.
ordered_json judge_file(const std::string& path, const recordings::TrainingSetOptions& options) {
  ordered_json json = {{"file", path},
                       {"verdict", kVerdicts[2]},
                       {"reasons", ordered_json::array()},
                       {"length_h", nullptr},
                       {"step_s", nullptr},
                       {"temperature_degc", {nullptr, nullptr}},
                       {"noise_deg_per_h", nullptr}};
  auto loaded = load(path, options);
  if (!loaded) {
    json["reasons"].push_back(loaded.error().what);
    return json;
  }
  auto& [recording, table] = *loaded;
  const std::vector<double> degc = table.column(compensation::kInputTemperature);
  json["temperature_degc"] = {std::ranges::min(degc), std::ranges::max(degc)};
  json["length_h"] = static_cast<double>(table.last_s - table.first_s + 1) / 3600;
  if (const double step_s = step_of(recording, table); std::isfinite(step_s)) json["step_s"] = step_s;
  if (const auto noise = evaluation::noise_floor(table.bias_deg_per_h, table.follows)) json["noise_deg_per_h"] = *noise;
  auto [quality, unusable] = analysis::usability_of(*loaded, true);
  std::vector<std::string> doubts = recording.questions();
  if (quality && quality->verdict == evaluation::Verdict::kWarn)
    doubts.push_back(analysis::data_quality_words(*quality));
  json["verdict"] = kVerdicts[!unusable.empty() ? 2 : doubts.empty() ? 0 : 1];
  if (!unusable.empty()) json["reasons"].push_back(std::move(unusable));
  for (std::string& doubt : doubts) json["reasons"].push_back(std::move(doubt));
  return json;
}

/// Returns 1 if no recording can be used for training.
int inspect_each(const std::vector<std::string>& paths, const recordings::TrainingSetOptions& options, bool json) {
  report::Table table{
      "files", "Recordings", "",
      report::columns(
          "file: | length [h] | step [s] | T from [degC] | to [degC] | noise [deg/h] | verdict: | first reason:")};
  std::map<std::string, std::size_t> counts;
  ordered_json rows = ordered_json::array();
  for (const std::string& path : paths) {
    const ordered_json& row = rows.emplace_back(judge_file(path, options));
    const auto number = [](const ordered_json& value) { return value.is_null() ? kUnknown : value.get<double>(); };
    const ordered_json &degc = row["temperature_degc"], &reasons = row["reasons"];
    ++counts[row["verdict"].get<std::string>()];
    table.rows.push_back({shortened(std::filesystem::path(path).filename().string(), 24),
                          report::fixed_cell(number(row["length_h"]), 2),
                          report::general_cell(number(row["step_s"]), 3), report::fixed_cell(number(degc[0]), 1),
                          report::fixed_cell(number(degc[1]), 1),
                          report::general_cell(number(row["noise_deg_per_h"]), 2), row["verdict"].get<std::string>(),
                          reasons.empty() ? "" : shortened(printable(reasons[0].get<std::string>()), 90)});
  }
  if (json) {
    fmt::print("{}\n", json_text(rows, 2));
  } else {
    fmt::print("{}\n{} good, {} doubtful, {} unusable: train and compare leave the unusable ones out.\n",
               report::plain_text(table), counts["good"], counts["doubtful"], counts["unusable"]);
  }
  return counts["unusable"] == paths.size() ? 1 : 0;
}

}  // namespace

void add_inspect_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("inspect", "show how a file of another program is understood, before training");
  const auto json = std::make_shared<bool>();
  const auto files = std::make_shared<std::vector<std::string>>();
  const auto options = std::make_shared<recordings::TrainingSetOptions>();  // of one file: only its table
  add_options(*command, {{"files", files.get(), "plain table; of several recordings: a line each"}}, Need::kRequired);
  add_source_options(*command, options->source);
  add_site_options(*command, options->site);
  add_window_options(*command, *options);
  add_options(*command, {{"--json", json.get(), "print JSON"}});
  tools::add_examples(*command, {"prismcal inspect chamber.csv", "prismcal inspect export.csv --decimal , --json",
                                 "prismcal inspect day*.csv --latitude 48.1 --elevation 90"});
  command->callback([json, files, options, &code] {
    code = files->size() > 1 ? inspect_each(*files, *options, *json)
                             : exit_code(inspect(files->front(), options->source.table, *json));
  });
}

}  // namespace prism::commands
