// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/evaluation/drift_fit.hpp"
#include "compensation/training/response.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/block_table.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/method_options.hpp"
#include "tools/prismcal/model_evaluation.hpp"
#include "tools/prismcal/training_set.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::commands {
namespace {

using report::Cell;
using report::Emphasis;

struct CompareChoice {
  std::vector<std::string> models, recordings;  ///< with leave_one_out `models` are methods
  std::string inputs = "T,dTdt,U";              ///< of leave_one_out
  recordings::TrainingSetOptions training;      ///< its window is of leave_one_out
  bool leave_one_out = false;
  CommonOptions common;
};

/// A model, or a method of leave_one_out.
struct Candidate {
  std::string name;                                         ///< short, unique: the model's file, or the method
  compensation::ModelPtr model;                             ///< null: a method
  std::vector<analysis::ModelEvaluation> evaluations = {};  ///< one per recording
  std::vector<std::string> trained_on = {};                 ///< recordings of which it has data

  /// Of the recordings that define one, %.
  std::vector<double> improvements() const {
    std::vector<double> percent;
    for (const analysis::ModelEvaluation& each : evaluations)
      if (each.stability.improvement) percent.push_back(100 * *each.stability.improvement);
    return percent;
  }
  double mean_improvement() const {
    const std::vector<double> percent = improvements();
    return percent.empty() ? -INFINITY : evaluation::neumaier_sum(percent) / static_cast<double>(percent.size());
  }
};

struct Comparison {
  std::vector<Candidate> candidates;
  std::vector<Loaded> recordings;  ///< without seconds
  recordings::Unusable left_out;
  std::string overlap;  ///< how the first of trained_on is known
};

/// The data quality of a recording, or why its own faults would decide the comparison.
Result<evaluation::DataQuality> judge(const Loaded& loaded, bool to_train) {
  auto [quality, reason] = analysis::usability_of(loaded, to_train);
  return reason.empty() ? std::move(quality) : make_error(loaded.table.name, reason);
}

/// Evaluates each model on a recording. Its blocks are read once if the features are the same.
Result<void> evaluate_models(const std::string& path, const CompareChoice& choice,
                             const analysis::CorrectionSettings& correction, recordings::UnmatchedRanges& unmatched,
                             Comparison& comparison) {
  std::optional<Loaded> first;
  std::vector<analysis::ModelEvaluation> evaluations;
  std::vector<std::string> overlaps;
  for (const Candidate& candidate : comparison.candidates) {
    const compensation::ModelInfo& info = candidate.model->info();
    std::optional<Loaded> own;
    if (!first || info.features != first->table.features) {
      auto read = load_blocks(path, info, choice.common, &unmatched);
      if (!read) return tl::unexpected(read.error());
      (first ? own : first) = std::move(*read);
    } else if (auto same = check_gyro(path, first->recording, info, choice.common); !same) {
      return same;
    }
    const Loaded& loaded = own ? *own : *first;
    if (choice.recordings.size() > 1) {
      if (auto usable = judge(loaded, false); !usable) return tl::unexpected(usable.error());
    }
    auto evaluated = analysis::evaluate_model(candidate.model, loaded.table, correction, choice.common.used_divisor());
    if (!evaluated) return tl::unexpected(evaluated.error());
    evaluations.push_back(std::move(*evaluated));
    overlaps.push_back(recordings::overlap_text(info.provenance_json, loaded.recording, loaded.table));
  }
  for (std::size_t m = 0; m < overlaps.size(); ++m) {
    comparison.candidates[m].evaluations.push_back(std::move(evaluations[m]));
    if (overlaps[m].empty()) continue;
    comparison.candidates[m].trained_on.push_back(first->table.name);
    if (comparison.overlap.empty()) comparison.overlap = overlaps[m];
  }
  first->table.seconds = {};
  comparison.recordings.push_back(std::move(*first));
  return {};
}

Result<void> compare_models(const CompareChoice& choice, const analysis::CorrectionSettings& correction,
                            Comparison& comparison) {
  for (const std::string& path : choice.models) {
    auto model = load_model(path);
    if (!model) return tl::unexpected(model.error());
    std::string name = std::filesystem::path(path).stem().string();
    if (std::ranges::count(comparison.candidates, name, &Candidate::name) > 0)
      name += fmt::format("#{}", comparison.candidates.size() + 1);
    comparison.candidates.push_back({std::move(name), std::move(*model)});
  }
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  auto left_out = recordings::use_each(choice.recordings, choice.training.strict, [&](const std::string& path) {
    return evaluate_models(path, choice, correction, unmatched, comparison);
  });
  if (!left_out) return tl::unexpected(left_out.error());
  comparison.left_out = std::move(*left_out);
  return unmatched.finish();
}

/// Trains each method on all recordings but one, and evaluates it on that one.
Result<void> leave_one_out(const CompareChoice& choice, const analysis::CorrectionSettings& correction,
                           Comparison& comparison) {
  const std::vector<std::string> inputs = tables::list_items(choice.inputs);
  std::vector<training::TrainingSettings> methods;
  for (const std::string& name : choice.models) {
    MethodOptions options;
    options.method = name;
    auto settings = settings_of(options);
    if (!settings) return tl::unexpected(settings.error());
    if (auto good = set_terms(options, inputs, *settings); !good) return good;
    settings->stop = stop_on_interrupt();
    settings->progress = progress_line(choice.common.quiet);
    methods.push_back(std::move(*settings));
    comparison.candidates.push_back({name, nullptr});
  }
  recordings::TrainingSetOptions options = choice.training;
  options.source = choice.common.source, options.site = choice.common.site;
  if (choice.common.quiet) options.source.table.silence();
  const auto read = [&] {
    return recordings::read_training_set(choice.recordings, inputs, options,
                                         [](const Loaded& loaded) { return judge(loaded, true); });
  };
  auto set = read();
  if (!set) return tl::unexpected(set.error());
  // One thermometer, one response: that of all recordings.
  const auto response = training::find_response(set->data, methods.front(), options.features.length_s);
  if (response && response->tau_s > 0) {
    options.features.response_s = response->tau_s;
    if (set = read(); !set) return tl::unexpected(set.error());
  }
  const std::size_t count = set->recordings.size();
  if (count < 2)
    return make_error("--leave-one-out",
                      fmt::format("found {} that can be used, expected 2 or more", counted(count, "recording")));
  for (std::size_t r = 0; r < count; ++r) {
    const recordings::BlockTable& table = set->recordings[r].table;
    training::TrainingData others;
    others.names = inputs;
    for (std::size_t other = 0; other < count; ++other)
      if (other != r) recordings::append_blocks(set->recordings[other].table, others);
    for (std::size_t m = 0; m < methods.size(); ++m) {
      compensation::ModelInfo info;
      info.features = set->features;
      auto trained = training::train(others, std::move(info), methods[m]);
      end_progress();
      if (!trained) return make_error(fmt::format("without {}", table.name), trained.error().text());
      auto evaluated = analysis::evaluate_model(trained->model, table, correction, choice.common.used_divisor());
      if (!evaluated) return tl::unexpected(evaluated.error());
      comparison.candidates[m].evaluations.push_back(std::move(*evaluated));
    }
  }
  comparison.recordings = std::move(set->recordings);
  comparison.left_out = std::move(set->left_out);
  return {};
}

/// How much better `best` is than `other`, in points, with its 95 % interval; over the recordings, or in the only one.
std::optional<evaluation::Estimate> gain_of(const Candidate& best, const Candidate& other,
                                            const Comparison& comparison) {
  if (comparison.recordings.size() == 1)
    return analysis::gain_of(other.evaluations[0], best.evaluations[0], comparison.recordings[0].table);
  std::vector<double> points;
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    const auto &one = best.evaluations[r].stability.improvement, &two = other.evaluations[r].stability.improvement;
    if (one && two) points.push_back(100 * (*one - *two));
  }
  return points.size() < 2 ? std::nullopt : std::optional(evaluation::mean_with_interval(points));
}

/// The best candidate against each other: "composite is better than stepwise by 4.1 points (1.2 to 7.0) over 12
/// recordings; ir-lssvm: not distinguishable".
std::string verdict(const Comparison& comparison) {
  const Candidate& best = *std::ranges::max_element(comparison.candidates, {}, &Candidate::mean_improvement);
  std::vector<std::string> better, alike;
  for (const Candidate& other : comparison.candidates) {
    if (&other == &best) continue;
    const auto gain = gain_of(best, other, comparison);
    if (gain && gain->low > 0)
      better.push_back(
          fmt::format("{} by {:.1f} points ({:.1f} to {:.1f})", other.name, gain->value, gain->low, gain->high));
    else
      alike.push_back(other.name);
  }
  std::string text;
  if (!better.empty()) text = fmt::format("{} is better than {}", best.name, fmt::join(better, " and "));
  if (!alike.empty())
    text += fmt::format("{}{}: not distinguishable{}", text.empty() ? "" : "; ", fmt::join(alike, ", "),
                        better.empty() ? fmt::format(" from {}", best.name) : "");
  if (text.empty()) text = fmt::format("{}: {:.1f} % in the mean", best.name, best.mean_improvement());
  return fmt::format("{}, over {}.", text, counted(comparison.recordings.size(), "recording"));
}

/// One row per recording, one column per candidate; then mean, worst and wins.
report::Table comparison_table(const Comparison& comparison, evaluation::Divisor divisor) {
  report::Table table{"comparison", "Improvement of each recording", "",
                      report::columns("recording: | before [deg/h]")};
  table.caption = fmt::format(
      "Improvement of the bias stability (1 sigma of {} s means, divisor {}). Wins: recordings in which it is the "
      "largest.",
      comparison.recordings.front().table.features.length_s, evaluation::divisor_text(divisor));
  const std::vector<Candidate>& candidates = comparison.candidates;
  const std::size_t width = std::max<std::size_t>(8, 60 / candidates.size());
  for (const Candidate& each : candidates) table.columns.emplace_back(shortened(each.name, width), "%");
  std::vector<std::size_t> wins(candidates.size());
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    const auto stability = [&](std::size_t m) { return candidates[m].evaluations[r].stability; };
    std::size_t best = 0;
    for (std::size_t m = 1; m < wins.size(); ++m) best = stability(m).after.sd < stability(best).after.sd ? m : best;
    ++wins[best];
    std::vector<Cell>& cells = table.rows.emplace_back();
    cells = {shortened(comparison.recordings[r].table.name, 28), report::fixed_cell(stability(0).before.sd, 5)};
    for (std::size_t m = 0; m < wins.size(); ++m) {
      const auto improvement = stability(m).improvement;
      const bool worse = improvement && *improvement < 0;
      cells.push_back(report::percent_cell(improvement, worse       ? Emphasis::kBad
                                                        : m == best ? Emphasis::kBest
                                                                    : Emphasis::kNone));
    }
  }
  std::vector<Cell> mean = {"mean", ""}, worst = {"worst", ""}, won = {"wins", ""};
  for (std::size_t m = 0; m < wins.size(); ++m) {
    const std::vector<double> percent = candidates[m].improvements();
    mean.push_back(report::fixed_cell(candidates[m].mean_improvement(), 2));
    worst.push_back(report::fixed_cell(percent.empty() ? kUnknown : std::ranges::min(percent), 2));
    won.push_back(report::count_cell(wins[m]));
  }
  if (comparison.recordings.size() > 1) table.rows.insert(table.rows.end(), {mean, worst, won});
  table.meaning = verdict(comparison);
  return table;
}

Result<int> compare(const CompareChoice& stated) {
  CompareChoice choice = stated;
  if (choice.recordings.size() > 1) choice.common.source.table.silence();  // inspect shows how each is read
  const auto test = test_statement(choice.common);
  if (!test) return tl::unexpected(test.error());
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  Comparison comparison;
  auto done = choice.leave_one_out ? leave_one_out(choice, *correction, comparison)
                                   : compare_models(choice, *correction, comparison);
  if (!done) return tl::unexpected(done.error());
  report::Report report;
  report.title = choice.leave_one_out ? "Comparison of methods" : "Comparison of models";
  report.subtitle =
      fmt::format("{} on {}", counted(comparison.candidates.size(), choice.leave_one_out ? "method" : "model"),
                  counted(comparison.recordings.size(), "recording"));
  report.tool = std::string("prismcal ") + kVersion;
  report.simulated = choice.common.simulated;
  for (const Candidate& each : comparison.candidates) {
    if (each.model)
      report.facts.emplace_back("model " + each.name,
                                fmt::format("{}, id {}", each.model->info().name, each.model->info().id));
    if (!each.trained_on.empty())
      add_overlap(report, fmt::format("{} for {}", fmt::join(each.trained_on, ", "), each.name), comparison.overlap);
  }
  std::vector<const Loaded*> all;
  std::string dates;
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    const auto& [recording, table] = comparison.recordings[r];
    add_recording(report, comparison.recordings[r],
                  analysis::recording_doubts(table, comparison.candidates[0].evaluations[r], recording.questions()),
                  dates);
    all.push_back(&comparison.recordings[r]);
  }
  const report::Table table = comparison_table(comparison, choice.common.used_divisor());
  report.sections = {{"comparison", "Comparison", {table}}, {"recordings", "Recordings", {recordings_table(all)}}};
  for (const auto& [path, reason] : comparison.left_out) report.facts.emplace_back("left out", reason);
  if (!choice.common.json) {
    for (const auto& [path, reason] : comparison.left_out) fmt::print(stderr, "left out: {}\n", printable(reason));
    if (!report.warning.empty()) fmt::print("{}\n\n", printable(report.warning));
    fmt::print("{}", report::plain_text(table));
  }
  fill_cover(report, {{"recordings", dates}}, *test);
  if (auto written = write_report(report, choice.common); !written) return tl::unexpected(written.error());
  return 0;
}

}  // namespace

void add_compare_command(CLI::App& app, int& code) {
  const auto [command, choice] = new_command<CompareChoice>(
      app, code, "compare", "compare models, or methods, on recordings in one table", compare);
  add_options(command,
              {{"models", &choice.models, "model files; with --leave-one-out methods"},
               {"--on", &choice.recordings, kRecordings}},
              Need::kRequired);
  add_options(command, {{"--leave-one-out", &choice.leave_one_out,
                         "train each method on all recordings but one, and test it on that one, in turn"},
                        {"--inputs", &choice.inputs, "of --leave-one-out"},
                        {"--strict", &choice.training.strict,
                         "end at a recording that cannot be used; else it is left out and named"}});
  add_common_options(command, choice.common);
  add_report_options(command, choice.common);
  add_window_options(command, choice.training);
  tools::add_examples(command,
                      {"prismcal compare old.json new.json --on day1.csv day2.csv day3.csv",
                       "prismcal compare composite stepwise ir-lssvm --leave-one-out --on day*.csv --out report"});
}

}  // namespace prism::commands
