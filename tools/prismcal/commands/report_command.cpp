// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/model_text.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"
#include "tools/prismcal/analysis/experiment.hpp"
#include "tools/prismcal/analysis/experiment_report.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/common_options.hpp"
#include "tools/prismcal/report/merged.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::commands {
namespace {

struct ReportChoice {
  std::string training, repeat, limits;
  std::vector<std::string> others;
  analysis::ExperimentSettings experiment;
  int threads = 2;
  bool force = false;
  std::string models = "paper";
  CommonOptions common;
};

/// Updates one line on stderr; prints one line per model if stderr is not a terminal.
void show_progress(std::size_t done, std::size_t total, const std::string& name) {
  const std::string next = printable(name);
  constexpr std::size_t kWidth = 30;
  const std::size_t filled = total > 0 ? kWidth * done / total : kWidth;
  if (isatty(2)) {
    fmt::print(stderr, "\r[{}{}] {}/{} {:<40.40}{}", std::string(filled, '#'), std::string(kWidth - filled, '.'), done,
               total, next, done == total ? "\n" : "");
  } else {
    fmt::print(stderr, "prismcal: {}/{} {}\n", done, total, next);
  }
}

report::Report begin_report(const std::vector<std::pair<std::string, const Loaded*>>& recordings,
                            const ReportChoice& choice, const evaluation::DataQuality& quality) {
  report::Report report;
  const std::string serial = recordings.front().second->recording.value("gyro_serial");
  report.title = "Bias compensation of gyro " + (serial.empty() ? std::string("without a serial number") : serial);
  report.subtitle =
      "Models of Tao et al., Sensors 2019 (LS, stepwise regression, LSSVM, IR-LSSVM), with additional tables";
  report.tool = std::string("prismcal ") + kVersion;
  report.facts = {
      {"divisor", fmt::format("{} in all standard deviations", evaluation::divisor_text(choice.common.divisor))},
      {"tuning", fmt::format("{} folds, seed {}; re-weighting {}", choice.experiment.folds, choice.experiment.seed,
                             choice.experiment.reweight_limit == 1 ? "once, as in the paper" : "to convergence")}};
  for (const auto& [role, loaded] : recordings) {
    append_recording_facts(report.facts, *loaded, role);
    report.simulated = report.simulated || is_simulated(loaded->recording, choice.common);
  }
  report::Section section{"recordings", "The recordings", {recordings_table(recordings)}};
  const std::string& training = recordings.front().second->table.name;
  section.blocks.push_back(analysis::data_quality_table(quality, training));
  section.blocks.push_back(analysis::data_quality_paragraph(quality, training));
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    section.blocks.push_back(analysis::record_figure(recordings[i].second->table, fmt::format("recording{}", i)));
  }
  report.sections.push_back(std::move(section));
  return report;
}

bool has_uhfo(const recordings::BlockTable& table) {
  const auto uhfo = table.column(compensation::kInputUhfo);
  return std::all_of(uhfo.begin(), uhfo.end(), [](double value) { return std::isfinite(value); });
}

/// The result of one axis.
struct AxisReport {
  report::Report report;
  report::Table ladder;
  std::vector<report::Cell> overview;  ///< the cells of overview_columns()
  bool within_limits = true;           ///< false if a limit is violated
};

std::vector<report::Column> overview_columns() {
  return {{"axis", {}, false}, {"model", {}, false}, {"before", "deg/h"},
          {"after", "deg/h"},  {"improvement", "%"}, {"worst other profile", "%"}};
}

std::vector<report::Cell> overview_of(const analysis::Experiment& experiment, const std::string& axis) {
  const analysis::ExperimentRow& chosen = *analysis::chosen_row(experiment);
  const evaluation::BiasStability& repeat = analysis::on_repeat(chosen);
  std::optional<double> worst;
  for (std::size_t i = 1; i < chosen.evaluations.size(); ++i) {
    const auto improvement = chosen.evaluations[i].stability.improvement;
    if (improvement && (!worst || *improvement < *worst)) worst = improvement;
  }
  return {report::text_cell(axis),
          report::text_cell(analysis::method_text(chosen.spec) + " on " + chosen.spec.inputs_text()),
          report::fixed_cell(repeat.before.sd, 5),
          report::fixed_cell(repeat.after.sd, 5),
          report::percent_cell(repeat.improvement),
          report::percent_cell(worst)};
}

Result<AxisReport> report_axis(ReportChoice choice, const std::vector<analysis::Limit>& limits) {
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  std::vector<std::pair<std::string, std::string>> paths = {{"training", choice.training}, {"repeat", choice.repeat}};
  for (const std::string& other : choice.others) paths.emplace_back("other profile", other);
  std::vector<Loaded> loaded;
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  for (const auto& [role, path] : paths) {
    auto one = load_blocks(path, compensation::FeatureDefinition{}, nullptr, choice.common);
    if (!one) return tl::unexpected(one.error());
    unmatched.add(one->recording);
    loaded.push_back(std::move(*one));
  }
  if (auto good = unmatched.finish(); !good) return tl::unexpected(good.error());
  const auto quality = analysis::check_blocks(loaded.front().table);
  if (!quality) return tl::unexpected(quality.error());
  const std::string reason = analysis::data_quality_error(*quality);
  if (!choice.force && !reason.empty()) {
    fmt::print(stderr, "{}", report::plain_text(analysis::data_quality_table(*quality, loaded.front().table.name)));
    return make_error(choice.training, reason + " Use --force to train anyway.");
  }
  std::vector<std::pair<std::string, const Loaded*>> recordings;
  analysis::ExperimentData data{loaded.front().table, {}, *correction};
  bool uhfo = true;
  for (std::size_t i = 0; i < loaded.size(); ++i) {
    recordings.emplace_back(paths[i].first, &loaded[i]);
    uhfo = uhfo && has_uhfo(loaded[i].table);
    if (i > 0) data.evaluated.push_back(loaded[i].table);
  }
  choice.experiment.gyro_serial = loaded.front().recording.value("gyro_serial");
  const auto specs = choice.models == "paper" ? analysis::paper_models(uhfo) : analysis::ladder_models(uhfo);
  const auto progress = [&](std::size_t done, std::size_t total, const std::string& next) {
    show_progress(done, total, choice.common.source.axis.empty() ? next : choice.common.source.axis + ": " + next);
  };
  const auto experiment =
      analysis::run_experiment(std::move(data), specs, choice.common.divisor,
                               analysis::experiment_trainer(choice.experiment), progress, choice.threads);
  if (!experiment) return tl::unexpected(experiment.error());

  report::Report report = begin_report(recordings, choice, *quality);
  report.facts.emplace_back("correction", correction->text());
  AxisReport made;
  auto sections = analysis::experiment_sections(*experiment, limits, made.within_limits);
  report.facts.emplace_back("chosen model", fmt::format("{}, id {}", analysis::chosen_row(*experiment)->spec.key(),
                                                        analysis::chosen_row(*experiment)->trained.model->info().id));
  report.sections.insert(report.sections.begin(), std::move(sections.front()));
  report.sections.insert(report.sections.end(), std::make_move_iterator(sections.begin() + 1),
                         std::make_move_iterator(sections.end()));
  made.report = std::move(report);
  made.ladder = analysis::ladder_table(*experiment);
  made.overview = overview_of(*experiment, choice.common.source.axis);
  return made;
}

Result<bool> finish_report(const report::Report& report, const report::Table& first, const CommonOptions& common,
                           bool within_limits) {
  if (!common.json) fmt::print("{}", report::plain_text(first));
  if (const auto done = write_report(report, common); !done) return tl::unexpected(done.error());
  return within_limits;
}

/// The axis with the smallest improvement on the repeat run (column 4).
std::string axes_meaning(const report::Table& overview) {
  const report::Cell *least = nullptr, *axis = nullptr;
  for (const auto& row : overview.rows) {
    if (row[4].value && (least == nullptr || *row[4].value < *least->value)) least = &row[4], axis = &row[0];
  }
  if (least == nullptr) return "No axis has an improvement.";
  return fmt::format("Axis {} improves least, by {} %.", axis->text, least->text);
}

Result<bool> report_axes(ReportChoice choice, const std::vector<analysis::Limit>& limits,
                         const std::vector<std::string>& axes) {
  report::Table overview{
      "all_axes", "The chosen model of each axis",
      "Bias stability (1 sigma of 100 s means) on the repeat run, before and after the correction, and the worst "
      "improvement on another profile.",
      overview_columns()};
  std::vector<std::pair<std::string, report::Report>> reports;
  bool within_limits = true;
  for (const std::string& axis : axes) {
    choice.common.source.axis = axis;
    auto made = report_axis(choice, limits);
    if (!made) return make_error("axis " + axis, made.error().text());
    overview.rows.push_back(std::move(made->overview));
    overview.rows.back().front().link = "#" + report::id_of_axis(overview.rows.size(), "summary");
    reports.emplace_back(axis, std::move(made->report));
    within_limits = within_limits && made->within_limits;
  }
  overview.meaning = axes_meaning(overview);
  report::Section first{"all_axes_section", "All axes", {overview}};
  return finish_report(report::merged(std::move(reports), std::move(first)), overview, choice.common, within_limits);
}

Result<bool> make_report(const ReportChoice& choice) {
  const auto limits = analysis::read_limits(choice.limits);
  if (!limits) return tl::unexpected(limits.error());
  if (choice.common.source.axis.empty()) {
    const auto axes = recordings::axes_of(choice.training, choice.common.source);
    if (!axes) return tl::unexpected(axes.error());
    if (axes->size() > 1) return report_axes(choice, *limits, *axes);
  }
  const auto made = report_axis(choice, *limits);
  if (!made) return tl::unexpected(made.error());
  return finish_report(made->report, made->ladder, choice.common, made->within_limits);
}

}  // namespace

void add_report_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand(
      "report", "the paper's experiment: train all its models, evaluate them on a repeat run and other profiles");
  const auto choice = std::make_shared<ReportChoice>();
  command
      ->add_option("training", choice->training,
                   "recording to train on: prismd's log (file or folder), a capture, or CSV with --map")
      ->required();
  command->add_option("repeat", choice->repeat, "recording of the same profile, for the test")->required();
  command->add_option("others", choice->others, "recordings of other profiles");
  command
      ->add_option("--models", choice->models,
                   "paper (all models of its tables; default) or ladder (one model of each type, faster)")
      ->check(CLI::IsMember({"paper", "ladder"}));
  command->add_option("--limits", choice->limits,
                      "JSON file of specification limits: PASS or FAIL, exit code 1 on FAIL");
  command->add_option("--seed", choice->experiment.seed, "seed for shuffling the folds");
  command->add_option("--folds", choice->experiment.folds, "number of cross-validation folds")
      ->check(tools::within(2, 100));
  command
      ->add_option("--reweight", choice->experiment.reweight_limit,
                   "maximum number of weighted solves: 1 as in the paper, 500 (default) converges")
      ->check(tools::within(1, 10000));
  command->add_option("--threads", choice->threads, "models trained in parallel")->check(tools::within(1, 64));
  command->add_flag("--force", choice->force, "train even if the data-quality check rejects the recording");
  add_common_options(*command, choice->common);
  tools::add_examples(*command, {"prismcal report cycle1.pcap cycle2.pcap other.pcap --config gyro.json --out report"});
  command->callback([choice, &code] {
    choice->experiment.stop = stop_on_interrupt();
    const auto within_limits = make_report(*choice);
    const bool stopped = !within_limits && choice->experiment.stop->load();
    if (stopped) {
      fmt::print(stderr, "{}prismcal: interrupted while training: no report was written\n", isatty(2) ? "\n" : "");
    } else if (!within_limits) {
      fmt::print(stderr, "prismcal: {}\n", within_limits.error().text());
    }
    code = stopped ? kInterrupted : within_limits && *within_limits ? 0 : 1;
  });
}

}  // namespace prism::commands
