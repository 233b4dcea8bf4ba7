// SPDX-License-Identifier: MIT
#include "tools/prismcal/common_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <strings.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <optional>

#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "config/config.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::commands {
namespace {

bool begins_with_sim(const std::string& text) { return ::strncasecmp(text.c_str(), "sim", 3) == 0; }

/// Median over the seconds, which lost frames and partial seconds do not change.
double samples_per_second(const recordings::Recording& recording) {
  std::size_t position = recording.seconds / 2;
  for (const auto& [samples, seconds] : recording.samples) {
    if (position < seconds) return static_cast<double>(samples);
    position -= seconds;
  }
  return kUnknown;
}

}  // namespace

void add_common_options(CLI::App& command, CommonOptions& o) {
  add_source_options(command, o.source);
  add_site_options(command, o.site);
  const std::vector<std::string> policies(compensation::kExtrapolationNames.begin(),
                                          compensation::kExtrapolationNames.end());
  add_options(command, {{"--max-bias", &o.max_bias_deg_per_h,
                         "largest accepted bias, deg/h (default: from --config, else 100)", tools::positive()},
                        {"--any-gyro", &o.any_gyro, "accept a recording of another gyro than the model's"},
                        {"--json", &o.json, "print the report as JSON"},
                        {"--quiet", &o.quiet, "no remarks on stderr"}});
  add_options(
      command,
      {{"--divisor", &o.divisor, "divisor of the variance: N or N-1 (default)", one_of({"N", "N-1"})},
       {"--extrapolation", &o.extrapolation,
        "predictions outside the training range: preset, flag, clamp or shrink (default: from --config, else "
        "preset)",
        one_of(policies)},
       {"--fallback", &o.fallback, "model used while the window is not full (default: from --config, else none)"},
       {"--all-blocks", &o.all_blocks, "report every block and row of long recordings, not their means and extremes"},
       {"--simulated", &o.simulated, "mark all pages as simulated data"}},
      Need::kFew);
}

void add_report_options(CLI::App& command, CommonOptions& o) {
  add_options(command, {{"--out", &o.out, "folder for report.html, report.json and tables/*.csv"},
                        {"--pdf", &o.pdf, "file for the printed report; needs Chromium"}});
  add_options(command,
              {{"--paper", &o.paper, "paper of the printed report: A4 or letter", one_of({"A4", "letter"})},
               {"--test", &o.test, "JSON file of customer, station, operator, … for the first page"}},
              Need::kFew);
}

bool wants_report(const CommonOptions& options) { return !options.out.empty() || !options.pdf.empty(); }

Result<TestStatement> test_statement(const CommonOptions& options) {
  const auto text = options.test.empty() ? Result<std::string>("{}") : read_text_file(options.test);
  if (!text) return tl::unexpected(text.error());
  const auto document = parse_json_object(*text, options.test);
  if (!document) return tl::unexpected(document.error());
  const Section root(*document);
  TestStatement test;
  for (const char* key : {"document", "revision", "customer", "operator", "station", "mount", "chamber"})
    test.texts.emplace_back(key, root.text(key, "", TextRule::kText));
  test.texts.emplace_back("sensors", fmt::format("{}", fmt::join(root.texts("sensors", false), "; ")));
  constexpr const char* kBand = "warm_up_band_deg_per_h";
  if (root.has(kBand)) test.warm_up_band_deg_per_h = root.number(kBand, {1e-9, 1e6});
  if (auto done = root.finish(); !done) return tl::unexpected(done.error());
  return test;
}

void fill_cover(report::Report& report, const std::vector<std::pair<std::string, std::string>>& gyro,
                const TestStatement& test) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()).time_since_epoch();
  report.cover = gyro;
  report.cover.emplace_back("evaluated", utc_text(now.count()).substr(0, 10));
  report.cover.emplace_back("program", report.tool);
  report.cover.insert(report.cover.end(), test.texts.begin(), test.texts.end());
}

std::string dates_text(const std::string& name, std::optional<std::int64_t> begin_s, double length_s) {
  const std::string begin = begin_s ? utc_text(*begin_s).replace(10, 1, " ").substr(0, 16) + " UTC, " : "";
  return fmt::format("{}: {}{:.2f} h", name, begin, length_s / 3600);
}

Result<analysis::CorrectionSettings> correction_settings(const CommonOptions& options) {
  analysis::CorrectionSettings settings;
  std::string fallback = options.fallback;
  if (!options.source.config.empty()) {
    const auto config = config::load_config(options.source.config);
    if (!config) return tl::unexpected(config.error());
    const config::AxisConfig* axis = config::find_axis(*config, options.source.axis);
    if (axis == nullptr)
      return make_error(options.source.config,
                        fmt::format("found {} axes, expected --axis with one of them", config->axes.size()));
    settings.engine = axis->engine;
    settings.direction_rad = axis->direction_mrad / 1000;
    if (fallback.empty()) fallback = axis->fallback_model;
  }
  if (options.max_bias_deg_per_h) settings.engine.max_bias_deg_per_h = *options.max_bias_deg_per_h;
  const auto& names = compensation::kExtrapolationNames;
  if (const auto named = std::ranges::find(names, options.extrapolation); named != names.end())
    settings.engine.extrapolation = static_cast<compensation::Extrapolation>(named - names.begin());
  if (fallback.empty()) return settings;
  auto model = load_model(fallback);
  if (!model) return tl::unexpected(model.error());
  settings.fallback = std::move(*model);
  return settings;
}

Result<void> check_gyro(const std::string& path, const recordings::Recording& recording,
                        const compensation::ModelInfo& model, const CommonOptions& options) {
  const std::string serial = recording.value("gyro_serial"), axis = recording.value("axis");
  if (options.any_gyro || model.gyro_serial.empty() || serial.empty() || serial == "unknown") return {};
  const bool same = serial == model.gyro_serial;
  if (same && (model.gyro_axis.empty() || axis.empty() || axis == "-" || axis == model.gyro_axis)) return {};
  return make_error(path, fmt::format("found a recording of {}, expected {} as in the model; --any-gyro accepts it",
                                      same ? "axis " + axis : fmt::format("gyro \"{}\"", serial),
                                      same ? model.gyro_axis : fmt::format("\"{}\"", model.gyro_serial)));
}

Result<Loaded> load_blocks(const std::string& path, const compensation::ModelInfo& model, const CommonOptions& options,
                           recordings::UnmatchedRanges* unmatched) {
  recordings::SourceOptions source = options.source;
  if (options.quiet) source.table.silence();
  auto loaded = recordings::read_blocks(
      path, source, options.site, model.features, [&](const recordings::Recording& recording) -> Result<void> {
        if (auto same = check_gyro(path, recording, model, options); !same) return same;
        const std::vector<SensorName> available = recording.sensors();
        for (const SensorName& sensor : model.features.sensors) {
          if (sensor_index(available, sensor.name) == available.size())
            return make_error(path, fmt::format("found no sensor \"{}\" of the model; its sensors: {}", sensor.name,
                                                sensors_text(available)));
        }
        return {};
      });
  if (!loaded) return loaded;
  if (unmatched) {
    unmatched->add(loaded->recording);
  } else if (auto good = recordings::UnmatchedRanges(loaded->recording.unmatched).finish(); !good) {
    return tl::unexpected<Error>(good.error());
  }
  return loaded;
}

void add_overlap(report::Report& report, const std::string& recording, const std::string& overlap) {
  report.warning += fmt::format("{}Not a test on {}: {}.", report.warning.empty() ? "" : " ", recording, overlap);
}

void add_recording(report::Report& report, const Loaded& loaded, const std::vector<std::string>& doubts,
                   std::string& dates) {
  const auto& [recording, table] = loaded;
  const std::string role = "recording " + table.name;
  if (!doubts.empty())
    report.warning += fmt::format("{}Judge the recording {} before the model: {}{}", report.warning.empty() ? "" : " ",
                                  table.name, fmt::join(doubts, "; "), doubts.back().ends_with('?') ? "" : ".");
  const std::string serial = recording.value("gyro_serial"), site = recording.value("site");
  report.simulated = report.simulated || begins_with_sim(serial) || begins_with_sim(recording.value("instance"));
  dates +=
      (dates.empty() ? "" : "; ") + dates_text(table.name, table.is_date ? std::optional(table.first_s) : std::nullopt,
                                               static_cast<double>(table.last_s - table.first_s + 1));
  for (const recordings::SourceFile& file : recording.files)
    report.facts.emplace_back(role, fmt::format("{} ({} rows, SHA-256 {})", file.path, file.rows, file.sha256));
  for (const std::string& note : recording.remarks()) report.facts.emplace_back(role + ", left out", note);
  for (const std::string& question : recording.questions()) report.facts.emplace_back(role + ", question", question);
  std::string gyro = "serial " + (serial.empty() ? "not stated" : serial);
  for (const char* key : {"frames", "axis"}) {
    if (const std::string value = recording.value(key); !value.empty() && value != "-")
      gyro += fmt::format(", {} {}", key, value);
  }
  report.facts.emplace_back(role + ", gyro", gyro);
  report.facts.emplace_back(role + ", site",
                            fmt::format("{}; Earth rate on the axis, {:.6f} deg/h, subtracted",
                                        site.empty() ? "not stated" : site, table.earth_rate_deg_per_h));
}

report::Table recordings_table(const std::vector<const Loaded*>& recordings) {
  report::Table table{"recordings", "The recordings", "",
                      report::columns("recording: | used [s] | samples [1/s] | length [h] | blocks | gaps | "
                                      "missing [s] | lost frames | T from [degC] | T to [degC]")};
  std::size_t missing_s = 0;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const Loaded* loaded : recordings) {
    const recordings::BlockTable& t = loaded->table;
    const auto temperature = t.column(compensation::kInputTemperature);
    const auto [low, high] = std::ranges::minmax_element(temperature);
    const double hours = static_cast<double>(t.last_s - t.first_s + 1) / 3600;
    table.caption = fmt::format("Blocks of {} s, restarted after gaps longer than {} s.", t.features.length_s,
                                t.features.max_gap_s);
    table.rows.push_back({t.name, report::count_cell(loaded->recording.seconds - t.unused_s),
                          report::general_cell(samples_per_second(loaded->recording), 6), report::fixed_cell(hours, 2),
                          report::count_cell(t.size()), report::count_cell(t.gaps), report::count_cell(t.missing_s),
                          report::count_cell(t.missing_frames), report::fixed_cell(*low, 1),
                          report::fixed_cell(*high, 1)});
    missing_s += t.missing_s;
    lowest = std::min(lowest, *low);
    highest = std::max(highest, *high);
  }
  table.meaning =
      fmt::format("The recordings cover {:.1f} to {:.1f} degC; {}.", lowest, highest,
                  missing_s == 0 ? "no second is missing"
                                 : fmt::format("{} {} missing or without a value, and not used",
                                               counted(missing_s, "second"), missing_s == 1 ? "is" : "are"));
  return table;
}

Result<void> write_report(const report::Report& complete, const CommonOptions& options) {
  report::Report report = options.all_blocks ? complete : report::reduced(complete);
  report.paper = options.paper;
  if (options.json) fmt::print("{}", report::json_text(report));
  if (!options.pdf.empty()) {
    if (auto done = report::print_pdf(report::html_page(report), options.pdf); !done) return done;
    if (!options.quiet) fmt::print(stderr, "report: {}\n", options.pdf);
  }
  if (options.out.empty()) return {};
  std::error_code error;
  const std::filesystem::path folder(options.out);
  std::filesystem::create_directories(folder / "tables", error);
  if (error) return make_error(options.out, error.message());
  for (const auto& [name, text] :
       {std::pair{"report.html", report::html_page(report)}, {"report.json", report::json_text(report)}}) {
    if (auto done = write_text_file((folder / name).string(), text); !done) return done;
  }
  for (const auto& [name, text] : report::csv_files(report)) {
    if (auto done = write_text_file((folder / "tables" / name).string(), text); !done) return done;
  }
  if (!options.quiet) fmt::print(stderr, "report: {}\n", (folder / "report.html").string());
  return {};
}

}  // namespace prism::commands
