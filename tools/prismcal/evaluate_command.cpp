// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <variant>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/limits.hpp"
#include "tools/prismcal/model_evaluation.hpp"
#include "tools/prismcal/recording_report.hpp"

namespace prism::commands {
namespace {

using Case = analysis::EvaluatedRecording;

report::Report begin_report(const compensation::Model& model, const std::string& path, const std::vector<Case>& cases,
                            const CommonOptions& options, std::string& dates) {
  const compensation::ModelInfo& info = model.info();
  report::Report report;
  const std::string serial = cases.front().loaded.recording.value("gyro_serial");
  report.title = "Evaluation of gyro " + (serial.empty() ? std::string("without a serial number") : serial);
  report.subtitle = fmt::format("Model \"{}\" ({}) on {}", info.name, info.kind, counted(cases.size(), "recording"));
  report.tool = std::string("prismcal ") + kVersion;
  report.simulated = options.simulated;
  report.facts = {
      {"model", fmt::format("{}, type {}, id {}", info.name, info.kind, info.id)},
      {"model, file", fmt::format("{} (SHA-256 {})", std::filesystem::path(path).filename().string(),
                                  sha256_of_file(path).value_or("unknown"))},
      {"model, inputs", fmt::format("{}; windows of {} s", fmt::join(info.inputs, ", "), info.features.length_s)},
      {"model, gyro", info.gyro_serial.empty() ? "any" : info.gyro_serial},
      {"divisor", fmt::format("{} in all standard deviations", evaluation::divisor_text(options.used_divisor()))}};
  for (const Case& c : cases) {
    if (!c.overlap.empty()) add_overlap(report, c.loaded.table.name, c.overlap);
    add_recording(report, c.loaded, c.doubts, dates);
  }
  return report;
}

/// The curves and tables of one recording.
report::Section recording_section(const Case& recording, const CommonOptions& options) {
  report::Section section{recording.id, "On " + recording.loaded.table.name};
  // A year's figures have 100 MB.
  const auto add = [&](report::Block block) {
    const bool figure = std::holds_alternative<report::Figure>(block);
    section.blocks.push_back(figure && !options.all_blocks ? report::reduced(std::move(block)) : std::move(block));
  };
  add(analysis::record_figure(recording));
  if (const auto quality = analysis::check_blocks(recording.loaded.table); quality && quality->nothing_to_compensate)
    add(report::Paragraph{recording.loaded.table.name + ": " + analysis::data_quality_error(*quality),
                          report::Emphasis::kBad});
  analysis::add_recording_blocks(recording, add);
  return section;
}

/// Prediction interval from all recordings; nullopt if there are fewer than three.
std::optional<report::Paragraph> together_paragraph(const std::vector<Case>& cases) {
  std::vector<double> improvements;
  for (const Case& c : cases) {
    if (const auto& improvement = c.evaluation.stability.improvement) improvements.push_back(*improvement);
  }
  const auto interval = evaluation::next_of_several(improvements);
  if (!interval) return std::nullopt;
  const std::string text = fmt::format(
      "Over {} recordings the bias stability {} by {:.1f} % (geometric mean of the residual shares). 95 % of further "
      "recordings like these: {} %; the variation between recordings is measured, not assumed.",
      improvements.size(), interval->value < 0 ? "gets worse" : "improves", 100 * std::abs(interval->value),
      analysis::interval_text(*interval));
  return report::Paragraph{text, report::Emphasis::kNone};
}

/// The first page: each result, the limits and the parameters. Sets `within_limits`.
report::Section conclusion(const std::vector<Case>& cases, const std::vector<analysis::Limit>& limits,
                           std::optional<double> warm_up_band, bool& within_limits) {
  report::Section section{"conclusion", "Conclusion"};
  const auto together = together_paragraph(cases);
  if (together) section.blocks.emplace_back(*together);
  std::vector<std::pair<std::string, std::vector<analysis::LimitCheck>>> checks;
  for (const Case& c : cases) {
    section.blocks.emplace_back(analysis::result_paragraph(c, !together));
    checks.emplace_back(c.loaded.table.name, analysis::check_limits(limits, analysis::measure_all(c)));
    for (const analysis::LimitCheck& check : checks.back().second) within_limits = within_limits && check.pass;
  }
  if (!limits.empty()) section.blocks.emplace_back(analysis::limits_table(checks));
  section.blocks.emplace_back(analysis::parameters_table(cases, warm_up_band));
  return section;
}

std::vector<std::pair<std::string, std::string>> cover_of(const compensation::Model& model,
                                                          const recordings::Recording& first,
                                                          const std::string& dates) {
  return {{"gyro", first.value("gyro_serial")},
          {"axis", first.value("axis")},
          {"model", fmt::format("{}, id {}", model.info().name, model.info().id.substr(0, 16))},
          {"recordings", dates}};
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
  const auto test = test_statement(choice.common);
  if (!test) return tl::unexpected(test.error());
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  std::vector<Case> cases;
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  for (const std::string& path : choice.recordings) {
    auto loaded = load_blocks(path, (*model)->info(), choice.common, &unmatched);
    if (!loaded) return tl::unexpected(loaded.error());
    auto evaluated = analysis::evaluate_model(*model, loaded->table, *correction, choice.common.used_divisor());
    if (!evaluated) return tl::unexpected(evaluated.error());
    Case& made = cases.emplace_back(
        analysis::evaluate_recording(fmt::format("r{}", cases.size() + 1), std::move(*loaded), std::move(*evaluated)));
    made.overlap = recordings::overlap_text((*model)->info().provenance_json, made.loaded.recording, made.loaded.table);
  }
  if (auto good = unmatched.finish(); !good) return tl::unexpected(good.error());

  std::string dates;
  report::Report report = begin_report(**model, choice.model, cases, choice.common, dates);
  report.facts.emplace(report.facts.begin() + 4, "correction", correction->text());
  std::vector<const Loaded*> all;
  for (const Case& c : cases) all.push_back(&c.loaded);
  fill_cover(report, cover_of(**model, cases.front().loaded.recording, dates), *test);
  Evaluation evaluation;
  report.sections.push_back(conclusion(cases, *limits, test->warm_up_band_deg_per_h, evaluation.within_limits));
  for (const Case& c : cases) report.sections.push_back(recording_section(c, choice.common));
  report.sections.push_back({"recordings", "Recordings", {recordings_table(all)}});
  for (const Loaded* loaded : all) {
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
  const auto [command, choice] = new_command<EvaluateChoice>(
      app, code, "evaluate", "evaluate a model on recordings: stability, Allan deviation, limits, report", evaluate);
  add_options(command, {{"model", &choice.model, "model file"}, {"recordings", &choice.recordings, kRecordings}},
              Need::kRequired);
  add_options(command,
              {{"--limits", &choice.limits, "JSON file of specification limits: PASS or FAIL, exit code 1 on FAIL"},
               {"--in-sample", &choice.in_sample,
                "exit code 0 also if the model was trained on these recordings; otherwise it is 3"}});
  refuse_removed(command, "--training", "the figure of the bias marks what is outside the training range");
  add_common_options(command, choice.common);
  add_report_options(command, choice.common);
  tools::add_examples(command, {"prismcal evaluate model.json logs/ --config gyro.json --out report",
                                "prismcal evaluate model.json repeat.csv --limits limits.json"});
}

}  // namespace prism::commands
