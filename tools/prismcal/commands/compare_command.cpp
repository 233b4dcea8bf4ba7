// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "base/escape.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"
#include "tools/prismcal/analysis/model_evaluation.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/common_options.hpp"
#include "tools/prismcal/commands/option_table.hpp"
#include "tools/prismcal/recordings/fingerprint.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::commands {
namespace {

using report::Cell;
using report::Emphasis;

struct CompareChoice {
  std::vector<std::string> models, recordings;
  CommonOptions common;
};

struct Comparison {
  std::vector<compensation::ModelPtr> models;
  std::vector<Loaded> recordings;  ///< with the blocks of the first model, without seconds
  std::vector<std::vector<analysis::ModelEvaluation>> evaluations;  ///< [m][r]: model m on recording r
  std::vector<std::pair<std::string, std::string>> overlaps;        ///< recording, and overlap_text()
};

Result<Comparison> evaluate_all(const CompareChoice& choice) {
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  Comparison comparison;
  for (const std::string& path : choice.models) {
    auto model = load_model(path);
    if (!model) return tl::unexpected(model.error());
    comparison.models.push_back(std::move(*model));
  }
  comparison.evaluations.resize(comparison.models.size());
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  for (const std::string& path : choice.recordings) {
    std::optional<Loaded> of_first;
    for (std::size_t m = 0; m < comparison.models.size(); ++m) {
      const compensation::ModelPtr& model = comparison.models[m];
      const compensation::ModelInfo& info = model->info();
      std::optional<Loaded> own;
      if (!of_first || info.features != of_first->table.features) {
        auto read = load_blocks(path, info.features, &info, choice.common);
        if (!read) return tl::unexpected(read.error());
        unmatched.add(read->recording);
        (of_first ? own : of_first) = std::move(*read);
      } else if (auto same = check_gyro(path, of_first->recording, info, choice.common); !same) {
        return tl::unexpected(same.error());
      }
      const Loaded& loaded = own ? *own : *of_first;
      auto evaluated = analysis::evaluate_model(model, loaded.table, *correction, choice.common.used_divisor());
      if (!evaluated) return tl::unexpected(evaluated.error());
      comparison.evaluations[m].push_back(std::move(*evaluated));
      std::string overlap = recordings::overlap_text(info.provenance_json, loaded.recording, loaded.table);
      if (!overlap.empty())
        comparison.overlaps.emplace_back(fmt::format("{} for {}", loaded.table.name, info.name), std::move(overlap));
    }
    of_first->table.seconds = {};
    comparison.recordings.push_back(std::move(*of_first));
  }
  if (auto good = unmatched.finish(); !good) return tl::unexpected(good.error());
  return comparison;
}

/// The best model on each recording, and whether it differs from the first.
std::string comparison_meaning(const Comparison& comparison) {
  std::string text;
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    std::size_t best = 0;
    for (std::size_t m = 1; m < comparison.models.size(); ++m) {
      if (comparison.evaluations[m][r].stability.after.sd < comparison.evaluations[best][r].stability.after.sd)
        best = m;
    }
    text += fmt::format("{}On {} \"{}\" leaves the least drift", text.empty() ? "" : " ",
                        comparison.recordings[r].table.name, comparison.models[best]->info().name);
    if (best > 0) {
      const Cell cell = analysis::difference_cell(comparison.evaluations[0][r], comparison.evaluations[best][r],
                                                  comparison.recordings[r].table);
      text += fmt::format(" (against the first: {} points)", cell.text);
    }
    text += ".";
  }
  return text;
}

/// One row per model, several columns per recording. Marks the lowest sigma. "change" and "against the first" are
/// relative to the first model.
report::Table comparison_table(const Comparison& comparison, evaluation::Divisor divisor) {
  report::Table table{"comparison", "Models on recordings", "", report::columns("model: | kind: | id:")};
  table.caption = fmt::format(
      "Bias stability: 1 sigma of {} s means, divisor {}. Change: of sigma after compensation, relative to the first "
      "model. "
      "95 % of further: 95 % prediction interval of the improvement in another recording of the same profile. Against "
      "the "
      "first: the same interval for the difference of the improvements. Off: blocks outside the training range.",
      comparison.models.front()->info().features.length_s, evaluation::divisor_text(divisor));
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    const std::string& name = comparison.recordings[r].table.name;
    table.columns.emplace_back(name + ": before", "deg/h");
    for (const report::Column& column :
         report::columns("after [deg/h] | improvement [%] | 95 % of further [%] | change [%] | "
                         "against the first [points] | off [%]"))
      table.columns.push_back(column);
  }
  for (std::size_t m = 0; m < comparison.models.size(); ++m) {
    const compensation::ModelInfo& info = comparison.models[m]->info();
    std::vector<Cell> cells = {info.name, info.kind, info.id.substr(0, 12)};
    for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
      const analysis::ModelEvaluation& evaluated = comparison.evaluations[m][r];
      const evaluation::BiasStability& s = evaluated.stability;
      const double first = comparison.evaluations[0][r].stability.after.sd;
      const bool best = std::all_of(comparison.evaluations.begin(), comparison.evaluations.end(),
                                    [&](const auto& row) { return row[r].stability.after.sd >= s.after.sd; });
      cells.push_back(report::fixed_cell(s.before.sd, 5));
      cells.push_back(report::fixed_cell(s.after.sd, 5, best ? Emphasis::kBest : Emphasis::kNone));
      cells.push_back(
          report::percent_cell(s.improvement, s.improvement && *s.improvement < 0 ? Emphasis::kBad : Emphasis::kNone));
      cells.push_back(analysis::interval_text(evaluated.improvement_interval));
      cells.push_back(report::percent_cell(m > 0 && first > 0 ? std::optional(s.after.sd / first - 1) : std::nullopt));
      cells.push_back(
          m == 0 ? Cell(report::kNothing)
                 : analysis::difference_cell(comparison.evaluations[0][r], evaluated, comparison.recordings[r].table));
      cells.push_back(report::fixed_cell(evaluated.extrapolated_percent(), 1));
    }
    table.rows.push_back(std::move(cells));
  }
  table.meaning = comparison_meaning(comparison);
  return table;
}

Result<int> compare(const CompareChoice& choice) {
  const auto comparison = evaluate_all(choice);
  if (!comparison) return tl::unexpected(comparison.error());
  report::Report report;
  report.title = "Comparison of models";
  report.subtitle = fmt::format("{} models on {} recordings", comparison->models.size(), comparison->recordings.size());
  report.tool = std::string("prismcal ") + kVersion;
  std::vector<std::pair<std::string, const Loaded*>> all;
  for (const compensation::ModelPtr& model : comparison->models)
    report.facts.emplace_back("model " + model->info().name, "id " + model->info().id);
  for (const Loaded& loaded : comparison->recordings) {
    append_recording_facts(report.facts, loaded, "recording " + loaded.table.name);
    report.simulated = report.simulated || is_simulated(loaded.recording, choice.common);
    all.emplace_back("evaluated", &loaded);
  }
  for (const auto& [recording, overlap] : comparison->overlaps) add_overlap(report, recording, overlap);
  for (std::size_t r = 0; r < comparison->recordings.size(); ++r) {
    const Loaded& loaded = comparison->recordings[r];
    add_doubts(report, loaded.table.name,
               analysis::recording_doubts(loaded.table, comparison->evaluations[0][r], loaded.recording.questions()));
  }
  const report::Table table = comparison_table(*comparison, choice.common.used_divisor());
  report.sections = {{"comparison", "Comparison", {table}}, {"recordings", "Recordings", {recordings_table(all)}}};
  if (!choice.common.json && !report.warning.empty()) fmt::print("{}\n\n", printable(report.warning));
  if (!choice.common.json) fmt::print("{}", report::plain_text(table));
  if (auto done = write_report(report, choice.common); !done) return tl::unexpected(done.error());
  return 0;
}

}  // namespace

void add_compare_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("compare", "compare models on recordings in one table");
  const auto choice = std::make_shared<CompareChoice>();
  add_options(*command,
              {{"models", &choice->models, "model files; the first is the reference"},
               {"--on", &choice->recordings, kRecordings}},
              Need::kRequired);
  add_common_options(*command, choice->common);
  tools::add_examples(*command, {"prismcal compare old.json new.json --on repeat.csv --on other.csv"});
  command->callback([choice, &code] { code = exit_code(compare(*choice)); });
}

}  // namespace prism::commands
