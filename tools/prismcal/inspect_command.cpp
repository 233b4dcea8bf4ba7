// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/evaluation/data_quality.hpp"
#include "compensation/features.hpp"
#include "compensation/sample.hpp"
#include "config/search_path.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/quantity_map.hpp"
#include "tools/prismcal/recording.hpp"
#include "tools/prismcal/sample_grid.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {
namespace {

struct InspectChoice {
  std::string file;
  tables::TableOptions table;
  bool json = false;
};

/// At most 64 means of equal numbers of rows, in order; kUnknown without a value. The number of rows doubles whenever
/// there are twice as many means.
class Course {
 public:
  void add(double value) {
    if (std::isfinite(value)) sum_ += value, ++known_;
    if (++rows_ < each_) return;
    means_.push_back(known_ > 0 ? sum_ / static_cast<double>(known_) : kUnknown);
    sum_ = 0, known_ = rows_ = 0;
    if (means_.size() < 2 * kMost) return;
    means_ = halved();
    each_ *= 2;
  }
  std::vector<double> means() const { return means_.size() > kMost ? halved() : means_; }

 private:
  std::vector<double> halved() const {
    std::vector<double> half;
    for (std::size_t i = 0; i + 1 < means_.size(); i += 2) {
      const double a = means_[i], b = means_[i + 1];
      half.push_back(std::isnan(a) ? b : std::isnan(b) ? a : (a + b) / 2);
    }
    return half;
  }

  static constexpr std::size_t kMost = 64;
  std::vector<double> means_;
  double sum_ = 0;
  std::size_t known_ = 0, rows_ = 0, each_ = 1;
};

struct ColumnSummary {
  tables::Header header;
  tables::ColumnKind kind = tables::ColumnKind::kText;
  double smallest = kUnknown, largest = kUnknown;  ///< as in the file
  std::size_t missing = 0;
  Course course = {};

  void take(double value) {
    course.add(value);
    if (!std::isfinite(value)) return;
    smallest = std::fmin(smallest, value);
    largest = std::fmax(largest, value);
  }
};

struct TimeSummary {
  std::string column, format;
  std::int64_t first_ns = 0, last_ns = 0;
  bool is_date = false;  ///< ns since 1970 UTC; otherwise since the origin of the file
  std::optional<recordings::SampleGrid> grid;
  std::string no_grid;  ///< why sample_grid() found no sample time
};

struct TableSummary {
  std::string form, command;  ///< command: train_command()
  bool states_rate = false;   ///< the command is complete but for the site
  std::size_t rows = 0, torn = 0;
  std::vector<ColumnSummary> columns;
  std::optional<TimeSummary> time;
  std::vector<std::string> remarks;  ///< findings of a training with the columns that the table names, one line each
  std::string problem;               ///< of the time, or of the first bad row: the summary ends there; empty: none
};

/// The findings of a training with the columns that the table names, which are read again, but for those on the time;
/// the reason if it cannot use them.
std::vector<std::string> remarks_on(const tables::PlainTable& table, const tables::TableOptions& options) {
  recordings::SourceOptions source;
  source.table = options;
  source.table.silence();
  source.map = recordings::suggested_map(table, options);
  std::erase_if(source.map, [](const std::string& entry) { return entry.ends_with(":UNIT"); });
  const auto is_time = [](const std::string& entry) { return entry.starts_with("time="); };
  if (options.interval_s == 0 && std::none_of(source.map.begin(), source.map.end(), is_time)) return {};
  const auto ignore = [](const auto&...) { return Result<void>(); };
  auto recording = recordings::read_recording(table.path(), source, {ignore, ignore});
  if (!recording) return {recording.error().what};
  std::erase_if(recording->findings,
                [](const recordings::Finding& finding) { return finding.kind == "time"; });  // TimeSummary
  std::vector<std::string> remarks = recording->remarks();
  for (std::string& question : recording->questions()) remarks.push_back(std::move(question));
  return remarks;
}

/// Errors: those of PlainTable::open().
Result<TableSummary> summarise_table(const std::string& path, const tables::TableOptions& options) {
  auto table = tables::PlainTable::open(path, options);
  if (!table) return tl::unexpected<Error>(table.error());
  TableSummary summary;
  summary.form = table->form_text();
  summary.command = recordings::train_command(*table, options);
  const auto rate = recordings::rate_column(*table);
  summary.states_rate = rate.has_value();
  tables::Selection selection;
  for (std::size_t i = 0; i < table->columns().size(); ++i) {
    summary.columns.push_back({table->columns()[i], table->kind(i)});
    if (table->kind(i) == tables::ColumnKind::kNumber) selection.numbers.push_back(i);
  }
  const std::vector<std::size_t> numbers = selection.numbers;
  const auto time = table->time_column();
  if (time) selection.time = tables::TimeSelection{*time};
  if (auto good = table->select(selection); !good) {
    summary.problem = good.error().text();
    selection.time.reset();
    if (good = table->select(selection); !good) return tl::unexpected<Error>(good.error());
  }
  std::vector<std::int64_t> stamps_ns;
  tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) summary.problem = more.error().text();
    if (!more || !*more) break;
    for (std::size_t i = 0; i < numbers.size(); ++i) summary.columns[numbers[i]].take(row.values[i]);
    if (table->time()) stamps_ns.push_back(row.time_ns);
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) summary.columns[numbers[i]].missing = table->missing(i);
  summary.rows = table->rows();
  summary.torn = table->torn();
  if (!stamps_ns.empty()) {
    summary.time = TimeSummary{table->columns()[*time].text,
                               table->time()->text(),
                               stamps_ns.front(),
                               stamps_ns.back(),
                               table->has_dates(),
                               {},
                               {}};
    const auto interval_s = options.interval_s > 0 ? std::optional(options.interval_s) : std::nullopt;
    if (auto grid = recordings::sample_grid(stamps_ns, path, interval_s))
      summary.time->grid = std::move(*grid);
    else
      summary.time->no_grid = std::move(grid.error().what);
  }
  if (rate && summary.problem.empty()) summary.remarks = remarks_on(*table, options);
  return summary;
}

/// The course of a column in one line of eighths of a block.
std::string spark(const ColumnSummary& column) {
  constexpr const char* kEighths[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const std::vector<double> course = column.course.means();
  double low = INFINITY, high = -INFINITY;
  for (const double mean : course) {
    if (std::isfinite(mean)) low = std::min(low, mean), high = std::max(high, mean);
  }
  // The means of a constant column differ by rounding.
  const bool constant = !(column.largest > column.smallest) || !(high > low);
  std::string text;
  const std::size_t step = course.size() > 32 ? 2 : 1;
  for (std::size_t i = 0; i < course.size(); i += step) {
    const double mean = course[i];
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
  const auto summary = summarise_table(choice.file, choice.table);
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
  const auto files = std::make_shared<std::vector<std::string>>();
  const auto options = std::make_shared<recordings::TrainingSetOptions>();  // of one file: only its table
  add_options(*command, {{"files", files.get(), "plain table, capture or raw bytes; of several: a line each"}},
              Need::kRequired);
  add_source_options(*command, options->source);
  add_site_options(*command, options->site);
  add_window_options(*command, *options);
  add_options(*command, {{"--json", &choice->json, "print JSON"}});
  tools::add_examples(*command, {"prismcal inspect chamber.csv", "prismcal inspect export.csv --decimal , --json",
                                 "prismcal inspect day*.csv --latitude 48.1 --elevation 90"});
  command->callback([choice, files, options, &code] {
    choice->file = files->front();
    choice->table = options->source.table;
    code = files->size() > 1 ? inspect_each(*files, *options, choice->json) : exit_code(run(*choice));
  });
}

}  // namespace prism::commands
