// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/evaluation/data_quality.hpp"
#include "compensation/features.hpp"
#include "config/search_path.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/recording_options.hpp"
#include "tools/prismcal/recordings/quantity_map.hpp"
#include "tools/prismcal/recordings/recording.hpp"
#include "tools/prismcal/recordings/table_summary.hpp"

namespace prism::commands {
namespace {

using recordings::ColumnSummary;
using recordings::TableSummary;
using recordings::TimeSummary;

struct InspectChoice {
  std::string file;
  tables::TableOptions table;
  bool json = false;
};

/// The course of a column in one line of eighths of a block.
std::string spark(const ColumnSummary& column) {
  constexpr const char* kEighths[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  double low = INFINITY, high = -INFINITY;
  for (const double mean : column.course) {
    if (std::isfinite(mean)) low = std::min(low, mean), high = std::max(high, mean);
  }
  // The means of a constant column differ by rounding.
  const bool constant = !(column.largest > column.smallest) || !(high > low);
  std::string text;
  const std::size_t step = column.course.size() > 32 ? 2 : 1;
  for (std::size_t i = 0; i < column.course.size(); i += step) {
    const double mean = column.course[i];
    const double part = !constant ? (mean / 2 - low / 2) / (high / 2 - low / 2) : 0;  // high - low may overflow
    text += std::isfinite(mean) ? kEighths[std::min(7, static_cast<int>(part * 8))] : " ";
  }
  return text;
}

std::string grid_text(const TimeSummary& time) {
  if (!time.grid) return time.no_grid;
  const recordings::SampleGrid& grid = *time.grid;
  return fmt::format(
      "every {:.6g} s; steps: mean {:.6g} s, median {:.6g} s, stamps within {:.3g} s of the grid; {} lost in {}",
      grid.interval_s, grid.mean_step_s, grid.median_step_s, grid.jitter_s, counted(grid.lost, "sample"),
      counted(grid.holes.size(), "hole"));
}

/// Of a record with fewer blocks than a training accepts.
void print_if_too_short(double seconds, const char* how = "") {
  const compensation::FeatureDefinition features;
  const double least_s =
      evaluation::DataQualitySettings{}.min_blocks.reject * features.length_s + compensation::history_s(features);
  if (seconds < least_s)
    fmt::print(
        "These are only {:.3g} s{}. The command needs at least {:g} s; a model needs a complete temperature cycle.\n",
        seconds, how, least_s);
}

void print(const TableSummary& summary, const std::string& path) {
  fmt::print("{}: {}\n{}, {}{}\n\n", path, summary.form, counted(summary.rows, "row"),
             counted(summary.columns.size(), "column"),
             summary.torn > 0 ? "; the last one has no line end and is left out" : "");
  std::size_t width = 6;
  for (const ColumnSummary& column : summary.columns) width = std::max(width, column.header.text.size());
  width = std::min<std::size_t>(width, 40);
  fmt::print("{:<{}}  {:<8} {:>14} {:>14} {:>8}\n", "column", width, "unit", "smallest", "largest", "holes");
  for (const ColumnSummary& column : summary.columns) {
    const std::string unit = column.header.unit ? std::string(column.header.unit->name) : "";
    if (column.kind == tables::ColumnKind::kNumber) {
      const auto number = [](double value) { return std::isfinite(value) ? fmt::format("{:.8g}", value) : "-"; };
      fmt::print("{:<{}}  {:<8} {:>14} {:>14} {:>8}  {}\n", shortened(column.header.text, 40), width, unit,
                 number(column.smallest), number(column.largest), column.missing, spark(column));
    } else {
      fmt::print("{:<{}}  {}\n", shortened(column.header.text, 40), width,
                 column.kind == tables::ColumnKind::kTime ? "time" : "text");
    }
  }
  if (summary.time)
    fmt::print("\ntime {} ({}): {} to {}\n  {}\n", summary.time->column, summary.time->format,
               tables::time_text(summary.time->first_ns, summary.time->is_date),
               tables::time_text(summary.time->last_ns, summary.time->is_date), grid_text(*summary.time));
  if (!summary.remarks.empty()) fmt::print("\n");
  for (const std::string& remark : summary.remarks) fmt::print("{}\n", printable(remark));
  if (!summary.problem.empty()) return;
  if (!summary.states_rate)
    fmt::print("\nNo column has the unit of a rate; replace COLUMN (its name or number) and UNIT (deg/h, deg/s, …):");
  else if (summary.command.find(":UNIT") != std::string::npos)
    fmt::print("\nReplace COLUMN (its name or number) and UNIT (degC, K or degF; V or mV):");
  fmt::print("\n{}\n{}\n", printable(summary.command), recordings::kSiteAdvice);
  if (summary.time) print_if_too_short(static_cast<double>(summary.time->last_ns - summary.time->first_ns) / 1e9);
}

nlohmann::ordered_json json_of(const TableSummary& summary, const std::string& path) {
  nlohmann::ordered_json json = {{"file", path},
                                 {"dialect", summary.form},
                                 {"rows", summary.rows},
                                 {"torn_rows", summary.torn},
                                 {"columns", nlohmann::ordered_json::array()}};
  for (const ColumnSummary& column : summary.columns) {
    json["columns"].push_back({{"header", column.header.text},
                               {"name", column.header.name},
                               {"unit", nullptr},
                               {"kind", column.kind == tables::ColumnKind::kNumber ? "number"
                                        : column.kind == tables::ColumnKind::kTime ? "time"
                                                                                   : "text"},
                               {"smallest", column.smallest},
                               {"largest", column.largest},
                               {"holes", column.missing}});
    if (column.header.unit) json["columns"].back()["unit"] = column.header.unit->name;
  }
  json["time"] = nullptr;
  if (summary.time) {
    const TimeSummary& time = *summary.time;
    json["time"] = {{"column", time.column},
                    {"format", time.format},
                    {"first_s", static_cast<double>(time.first_ns) / 1e9},
                    {"last_s", static_cast<double>(time.last_ns) / 1e9},
                    {"is_date", time.is_date},
                    {"interval_s", nullptr}};
    if (time.grid) {
      json["time"].update({{"interval_s", time.grid->interval_s},
                           {"mean_step_s", time.grid->mean_step_s},
                           {"median_step_s", time.grid->median_step_s},
                           {"jitter_s", time.grid->jitter_s},
                           {"lost", time.grid->lost},
                           {"holes", time.grid->holes.size()}});
    }
  }
  json["remarks"] = summary.remarks;
  json["command"] = summary.states_rate ? summary.command : "";
  json["problem"] = summary.problem;
  return json;
}

/// The configuration and the command to train on bytes that the description fits. The words in capitals are refused.
void print_next(const InspectChoice& choice, const std::string& kind, const wire::SniffScore& score) {
  const wire::FrameDescription& frames = *score.description;
  std::string site = "\"site\": {\"latitude_deg\": LATITUDE, \"elevation_deg\": ELEVATION, \"azimuth_deg\": AZIMUTH}",
              options;
  if (frames.axis_names.size() > 1) {
    std::string axes;
    for (const std::string& name : frames.axis_names)
      axes += fmt::format("{}\"{}\": {{\"elevation_deg\": ELEVATION, \"azimuth_deg\": AZIMUTH}}",
                          axes.empty() ? "" : ", ", name);
    site = fmt::format("\"site\": {{\"latitude_deg\": LATITUDE}},\n   \"axes\": {{{}}}", axes);
    options = " --axis " + frames.axis_names.front();
  }
  if (!frames.has(wire::ChannelRole::kUhfo)) options += " --inputs T,dTdt";
  fmt::print(
      "\nTo train on it, write gyro.json, with your values:\n"
      "  {{\"frames\": \"{}\", \"gyro\": {{\"serial\": \"SERIAL\"}}, {}}}\n"
      "then: prismcal train {} --config gyro.json{} --out model.json\n",
      frames.name, site, shell_word(choice.file), options);
  const bool timed = score.rate_hz > 0;
  print_if_too_short(static_cast<double>(score.rates) / (timed ? score.rate_hz : frames.rate_hz),
                     timed ? "" : " at the description's frame rate (another rate of this gyro: rate_hz in gyro.json)");
  if (kind != "capture")
    fmt::print(
        "Arrival times are not read from this kind of file: time comes from the description's rate (rate_hz), or from "
        "its counter with "
        "\"clock\": \"device\".\n");
}

/// The shipped and installed descriptions that fit the whole file, the best first. Errors: those of CaptureReader.
Result<std::vector<wire::SniffScore>> fitting_descriptions(const std::string& path) {
  std::error_code error;
  std::vector<wire::FrameDescriptionPtr> descriptions;
  for (const std::string& file : config::data_files("frames", std::filesystem::current_path(error))) {
    const auto text = config::read_data_file(file, "frames", "DESCRIPTION");
    if (!text) continue;
    if (const auto description = wire::parse_frame_description(*text, file)) descriptions.push_back(*description);
  }
  constexpr drivers::RawByteStream kAtOnce{1e12, 0};  // raw bytes have no times
  auto reader = drivers::CaptureReader::open(path, kAtOnce);
  if (!reader) return tl::unexpected<Error>(reader.error());
  wire::Sniffer sniffer(std::move(descriptions));
  while (const auto packet = reader->next()) {
    if (packet->event == drivers::CaptureEvent::kData)
      sniffer.feed(packet->bytes, reader->is_bare() ? 0 : packet->time_ns);
  }
  std::vector<wire::SniffScore> ranking = sniffer.ranking();
  std::erase_if(ranking, [](const wire::SniffScore& score) { return !score.fits; });
  return ranking;
}

/// A capture or raw bytes: the descriptions that fit.
Result<int> run_bytes(const InspectChoice& choice, const std::string& kind) {
  const auto fitting = fitting_descriptions(choice.file);
  if (!fitting) return tl::unexpected<Error>(fitting.error());
  nlohmann::ordered_json json = {{"file", choice.file}, {"kind", kind}, {"fits", nlohmann::ordered_json::array()}};
  if (!choice.json)
    fmt::print("{}: {}; {} {}\n", choice.file, kind,
               fitting->empty() ? "no frame description" : counted(fitting->size(), "frame description"),
               fitting->size() > 1 ? "fit" : "fits");
  for (const wire::SniffScore& score : *fitting) {
    json["fits"].push_back(
        {{"frames", score.description->name}, {"good_frames", score.frames}, {"bytes", score.bytes}});
    if (!choice.json) fmt::print("  {}\n", wire::sniff_line(score));
  }
  if (!choice.json && !fitting->empty()) print_next(choice, kind, fitting->front());
  if (!choice.json && fitting->empty())
    fmt::print(
        "\nTried: the shipped descriptions and those in ./frames. Describe its frames (docs/frames.md, part 1); "
        "then prismd --sniff {} DESCRIPTION.json\n",
        shell_word(choice.file));
  if (choice.json) fmt::print("{}\n", json_text(json, 2));
  return fitting->empty() ? 1 : 0;
}

Result<int> run(const InspectChoice& choice) {
  const auto kind = recordings::bytes_kind(choice.file);
  if (!kind) return tl::unexpected<Error>(kind.error());
  if (!kind->empty()) return run_bytes(choice, *kind);
  const auto summary = recordings::summarise_table(choice.file, choice.table);
  if (!summary) return tl::unexpected<Error>(summary.error());
  if (choice.json)
    fmt::print("{}\n", json_text(json_of(*summary, choice.file), 2));
  else
    print(*summary, choice.file);
  if (!summary->problem.empty() && !choice.json) fmt::print(stderr, "prismcal: {}\n", summary->problem);
  return summary->problem.empty() ? 0 : 1;
}

}  // namespace

void add_inspect_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("inspect", "show how a file of another program is understood, before training");
  const auto choice = std::make_shared<InspectChoice>();
  command->add_option("file", choice->file, "plain table, capture or raw bytes")->required();
  command->add_option("--interval", choice->table.interval_s, "seconds between rows")->check(tools::positive());
  add_table_options(*command, choice->table);
  command->add_flag("--json", choice->json, "print JSON");
  tools::add_examples(*command, {"prismcal inspect chamber.csv", "prismcal inspect export.csv --decimal , --json"});
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
