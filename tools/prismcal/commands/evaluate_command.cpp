// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"
#include "tools/prismcal/analysis/limits.hpp"
#include "tools/prismcal/analysis/recording_report.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/evaluation_run.hpp"
#include "tools/prismcal/commands/option_table.hpp"
#include "tools/prismcal/recordings/fingerprint.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::commands {
namespace {

using Case = RecordingEvaluation;

report::Report begin_report(const compensation::Model& model, const std::vector<Case>& cases,
                            const CommonOptions& options) {
  const compensation::ModelInfo& info = model.info();
  report::Report report;
  const std::string serial = cases.front().loaded.recording.value("gyro_serial");
  report.title = "Evaluation of gyro " + (serial.empty() ? std::string("without a serial number") : serial);
  report.subtitle = fmt::format("Model \"{}\" ({}) on {}", info.name, info.kind, counted(cases.size(), "recording"));
  report.tool = std::string("prismcal ") + kVersion;
  report.simulated =
      std::any_of(cases.begin(), cases.end(), [&](const Case& c) { return is_simulated(c.loaded.recording, options); });
  report.facts = {
      {"model", fmt::format("{}, type {}, id {}", info.name, info.kind, info.id)},
      {"model, inputs", fmt::format("{}; windows of {} s", fmt::join(info.inputs, ", "), info.features.length_s)},
      {"model, gyro", info.gyro_serial.empty() ? "any" : info.gyro_serial},
      {"divisor", fmt::format("{} in all standard deviations", evaluation::divisor_text(options.used_divisor()))}};
  for (const Case& c : cases) {
    if (!c.overlap.empty()) add_overlap(report, c.loaded.table.name, c.overlap);
    add_doubts(report, c.loaded.table.name, c.doubts);
  }
  for (const Case& c : cases) append_recording_facts(report.facts, c.loaded, "recording " + c.loaded.table.name);
  return report;
}

report::Section recording_section(const analysis::EvaluatedRecording& recording, const std::string& overlap,
                                  const std::vector<analysis::Measured>& measured,
                                  const std::vector<analysis::Limit>& limits, const CommonOptions& options,
                                  bool& within_limits) {
  report::Section section{
      recording.id, "On " + recording.table->name, {analysis::result_paragraph(recording, overlap)}};
  if (!limits.empty()) {
    const auto checks = analysis::check_limits(limits, measured);
    within_limits = within_limits && std::all_of(checks.begin(), checks.end(),
                                                 [](const analysis::LimitCheck& check) { return check.pass; });
    section.blocks.push_back(analysis::limits_table(checks, recording.id, recording.table->name));
  }
  // A year's figures have 100 MB.
  const auto add = [&](report::Block block) {
    const bool figure = std::holds_alternative<report::Figure>(block);
    section.blocks.push_back(figure && !options.all_blocks ? report::reduced(std::move(block)) : std::move(block));
  };
  add(analysis::record_figure(recording));
  if (const auto quality = analysis::check_blocks(*recording.table); quality && quality->nothing_to_compensate) {
    section.blocks.push_back(analysis::data_quality_paragraph(*quality, recording.table->name));
  }
  analysis::add_recording_blocks(recording, add);
  return section;
}

/// Prediction interval from all recordings; nullopt if there are fewer than three.
std::optional<report::Section> together_section(const std::vector<Case>& cases) {
  std::vector<double> improvements;
  for (const Case& c : cases) {
    if (const auto& improvement = c.evaluation.stability.improvement) improvements.push_back(*improvement);
  }
  const auto interval = evaluation::next_of_several(improvements, "");
  if (!interval) return std::nullopt;
  const std::string text = fmt::format(
      "Over {} recordings the bias stability improves by {:.1f} % (geometric mean of the residual shares). 95 % of "
      "further "
      "recordings like these: {} %; the variation between recordings is measured, not assumed.",
      improvements.size(), 100 * interval->value, analysis::interval_text(*interval));
  return report::Section{"together", "All recordings together", {report::Paragraph{text, report::Emphasis::kNone}}};
}

/// The exit code: a limit failed, or a recording was used in training.
int verdict(const Evaluation& evaluation, bool in_sample) {
  bool tests = true;
  for (const Case& c : evaluation.cases) {
    if (c.overlap.empty() || in_sample) continue;
    tests = false;
    fmt::print(stderr, "prismcal: {}: not a test: {}; expected another recording, or --in-sample\n",
               printable(c.loaded.table.name), printable(c.overlap));
  }
  return !evaluation.within_limits ? 1 : tests ? 0 : kNotATest;
}

Result<int> evaluate(const EvaluateChoice& choice) {
  const auto evaluation = evaluate_recordings(choice);
  if (!evaluation) return tl::unexpected(evaluation.error());
  if (!choice.common.json) fmt::print("{}", report::plain_text(evaluation->report));
  if (const auto done = write_report(evaluation->report, choice.common); !done) return tl::unexpected(done.error());
  return verdict(*evaluation, choice.in_sample);
}

}  // namespace

Result<Evaluation> evaluate_recordings(const EvaluateChoice& choice) {
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected(model.error());
  const auto limits = analysis::read_limits(choice.limits);
  if (!limits) return tl::unexpected(limits.error());
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  std::vector<Case> cases;
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  for (const std::string& path : choice.recordings) {
    auto loaded = load_blocks(path, (*model)->info().features, &(*model)->info(), choice.common);
    if (!loaded) return tl::unexpected(loaded.error());
    unmatched.add(loaded->recording);
    auto evaluated = analysis::evaluate_model(*model, loaded->table, *correction, choice.common.used_divisor());
    if (!evaluated) return tl::unexpected(evaluated.error());
    std::string overlap = recordings::overlap_text((*model)->info().provenance_json, loaded->recording, loaded->table);
    auto doubts = analysis::recording_doubts(loaded->table, *evaluated, loaded->recording.questions());
    cases.push_back({std::move(*loaded), std::move(*evaluated), std::move(overlap), std::move(doubts), {}});
  }
  std::optional<Loaded> training;
  if (!choice.training.empty()) {
    auto loaded = load_blocks(choice.training, (*model)->info().features, &(*model)->info(), choice.common);
    if (!loaded) return tl::unexpected(loaded.error());
    unmatched.add(loaded->recording);
    training = std::move(*loaded);
  }
  if (auto good = unmatched.finish(); !good) return tl::unexpected(good.error());

  report::Report report = begin_report(**model, cases, choice.common);
  report.facts.emplace(report.facts.begin() + 3, "correction", correction->text());
  std::vector<std::pair<std::string, const Loaded*>> all;
  for (const Case& c : cases) all.emplace_back("evaluated", &c.loaded);
  if (training) all.emplace_back("training", &*training);
  if (auto together = together_section(cases)) report.sections.push_back(std::move(*together));
  Evaluation evaluation;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const analysis::EvaluatedRecording recording =
        analysis::evaluate_recording(fmt::format("r{}", i + 1), cases[i].loaded.table, cases[i].evaluation,
                                     training ? &training->table : nullptr, !cases[i].doubts.empty());
    cases[i].measured = analysis::measure_all(recording);
    report.sections.push_back(recording_section(recording, cases[i].overlap, cases[i].measured, *limits, choice.common,
                                                evaluation.within_limits));
  }
  report.sections.push_back({"recordings", "Recordings", {recordings_table(all)}});
  for (const auto& [role, loaded] : all) {
    for (const recordings::Finding& finding : loaded->recording.findings)
      if (finding.kind == "absent")
        report.sections.back().blocks.push_back(
            report::Paragraph{loaded->recording.name + ": " + finding.text + ".", report::Emphasis::kNone});
  }
  evaluation.report = std::move(report);
  evaluation.cases = std::move(cases);
  return evaluation;
}

void add_evaluate_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("evaluate", "evaluate a model on recordings: stability, Allan deviation, limits, report");
  const auto choice = std::make_shared<EvaluateChoice>();
  add_options(*command, {{"model", &choice->model, "model file"}, {"recordings", &choice->recordings, kRecordings}},
              Need::kRequired);
  add_options(*command,
              {{"--training", &choice->training, "recording used for training, for the figure of the training range"},
               {"--limits", &choice->limits, "JSON file of specification limits: PASS or FAIL, exit code 1 on FAIL"},
               {"--in-sample", &choice->in_sample,
                "exit code 0 also if the model was trained on these recordings; otherwise it is 3"}});
  add_common_options(*command, choice->common);
  tools::add_examples(*command, {"prismcal evaluate model.json logs/ --config gyro.json --out report",
                                 "prismcal evaluate model.json repeat.csv --limits limits.json"});
  command->callback([choice, &code] { code = exit_code(evaluate(*choice)); });
}

}  // namespace prism::commands
