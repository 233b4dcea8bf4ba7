// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/data_quality_table.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/quantity_map.hpp"
#include "tools/prismcal/training_set.hpp"

namespace prism::commands {
namespace {

using recordings::Loaded;
using report::Emphasis;

enum Verdict { kGood, kDoubtful, kUnusable };
constexpr std::array kVerdicts = {"good", "doubtful", "unusable"};

struct Row {
  std::string path;
  Verdict verdict = kUnusable;
  std::vector<std::string> reasons;  ///< the first decides
  double hours = kUnknown, step_s = kUnknown, low_degc = kUnknown, high_degc = kUnknown, noise_deg_per_h = kUnknown;
};

/// Reads the blocks as a training does; a table without --map by the names and units of its columns.
Result<Loaded> load(const std::string& path, const recordings::TrainingSetOptions& options) {
  recordings::SourceOptions source = options.source;
  source.table.silence();
  source.several = true;
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

Row judge_file(const std::string& path, const recordings::TrainingSetOptions& options) {
  Row row{.path = path, .reasons = {}};
  auto loaded = load(path, options);
  if (!loaded) {
    row.reasons = {loaded.error().what};
    return row;
  }
  auto& [recording, table] = *loaded;
  const std::vector<double> degc = table.column(compensation::kInputTemperature);
  row.low_degc = std::ranges::min(degc), row.high_degc = std::ranges::max(degc);
  row.hours = static_cast<double>(table.last_s - table.first_s + 1) / 3600;
  row.step_s = step_of(recording, table);
  row.noise_deg_per_h = evaluation::noise_floor(table.bias_deg_per_h, table.follows).value_or(kUnknown);
  if (auto question = recordings::sign_question(table.mean_rate_deg_per_h(), table.earth_rate_deg_per_h))
    recording.findings.push_back(std::move(*question));
  row.verdict = kGood;
  const auto add = [&row](Verdict verdict, std::string text) {
    row.verdict = std::max(row.verdict, verdict);
    row.reasons.push_back(std::move(text));
  };
  auto [quality, unusable] = analysis::usability_of(*loaded, true);
  if (!unusable.empty()) add(kUnusable, std::move(unusable));
  for (std::string& text : recording.questions()) add(kDoubtful, std::move(text));
  if (quality && quality->verdict == evaluation::Verdict::kWarn) add(kDoubtful, analysis::data_quality_words(*quality));
  return row;
}

nlohmann::ordered_json json_of(const Row& row) {
  const auto number = [](double value) { return std::isfinite(value) ? nlohmann::ordered_json(value) : nullptr; };
  return {{"file", row.path},
          {"verdict", kVerdicts[row.verdict]},
          {"reasons", row.reasons},
          {"length_h", number(row.hours)},
          {"step_s", number(row.step_s)},
          {"temperature_degc", {number(row.low_degc), number(row.high_degc)}},
          {"noise_deg_per_h", number(row.noise_deg_per_h)}};
}

}  // namespace

int inspect_each(const std::vector<std::string>& paths, const recordings::TrainingSetOptions& options, bool json) {
  report::Table table{
      "files", "Recordings", "",
      report::columns(
          "file: | length [h] | step [s] | T from [degC] | to [degC] | noise [deg/h] | verdict: | first reason:")};
  std::array<std::size_t, kVerdicts.size()> counts{};
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const std::string& path : paths) {
    const Row row = judge_file(path, options);
    ++counts[row.verdict];
    rows.push_back(json_of(row));
    table.rows.push_back({shortened(std::filesystem::path(path).filename().string(), 24),
                          report::fixed_cell(row.hours, 2), report::general_cell(row.step_s, 3),
                          report::fixed_cell(row.low_degc, 1), report::fixed_cell(row.high_degc, 1),
                          report::general_cell(row.noise_deg_per_h, 2), kVerdicts[row.verdict],
                          row.reasons.empty() ? "" : shortened(printable(row.reasons.front()), 90)});
  }
  if (json) {
    fmt::print("{}\n", json_text(rows, 2));
  } else {
    fmt::print("{}\n{} good, {} doubtful, {} unusable: train and compare leave the unusable ones out.\n",
               report::plain_text(table), counts[kGood], counts[kDoubtful], counts[kUnusable]);
  }
  return counts[kUnusable] == paths.size() ? 1 : 0;
}

}  // namespace prism::commands
