// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/training/response.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/data_quality_table.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/fingerprint.hpp"
#include "tools/prismcal/method_options.hpp"
#include "tools/prismcal/model_evaluation.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/training_set.hpp"
#include "tools/prismcal/units.hpp"

namespace prism::commands {
namespace {

using report::Cell;
using report::Emphasis;

struct CompareChoice {
  std::vector<std::string> models, recordings;  ///< with leave_one_out `models` are methods
  std::string inputs = "T,dTdt,U";              ///< of leave_one_out
  recordings::TrainingSetOptions window;        ///< of leave_one_out
  bool leave_one_out = false, strict = false;
  CommonOptions common;
};

/// One row of the comparison per recording, one column per candidate.
struct Comparison {
  std::vector<std::string> candidates;                              ///< short, unique: the model's file, or the method
  std::vector<compensation::ModelPtr> models;                       ///< of leave_one_out: empty
  std::vector<Loaded> recordings;                                   ///< without seconds
  std::vector<std::vector<analysis::ModelEvaluation>> evaluations;  ///< [r][m]: candidate m on recording r
  std::vector<std::pair<std::string, std::string>> left_out;        ///< path and reason
  std::map<std::string, std::vector<std::string>> overlaps;         ///< recordings of which a candidate has data
  std::string overlap;                                              ///< how, of the first

  const evaluation::BiasStability& stability(std::size_t r, std::size_t m) const { return evaluations[r][m].stability; }
};

using Evaluations = std::vector<analysis::ModelEvaluation>;

/// Names of the files, without directory and ".json"; equal ones with their number.
std::vector<std::string> short_names(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) {
    std::string name = std::filesystem::path(path).stem().string();
    if (std::ranges::count(names, name) > 0) name += fmt::format("#{}", names.size() + 1);
    names.push_back(std::move(name));
  }
  return names;
}

/// A recording whose own faults would decide the comparison.
Result<void> check_usable(const Loaded& loaded, bool to_train) {
  const std::string reason = analysis::why_unusable(loaded, to_train);
  return reason.empty() ? Result<void>() : make_error(loaded.table.name, reason);
}

/// Calls `work` with each recording. One that fails is left out and named; with --strict, and if it is the only one,
/// its error is that of the command.
template <class Work>
Result<void> for_each_recording(const CompareChoice& choice, Comparison& comparison, const Work& work) {
  std::optional<Error> first;
  for (const std::string& path : choice.recordings) {
    auto done = work(path);
    if (done) continue;
    if (choice.strict || choice.recordings.size() == 1) return done;
    if (!first) first = done.error();
    comparison.left_out.emplace_back(path, done.error().text());
  }
  if (comparison.recordings.empty()) return tl::unexpected(*first);
  return {};
}

/// The blocks of a recording for each model: read once if the features are the same.
Result<void> evaluate_models(const std::string& path, const CompareChoice& choice,
                             const analysis::CorrectionSettings& correction, recordings::UnmatchedRanges& unmatched,
                             Comparison& comparison) {
  std::optional<Loaded> first;
  Evaluations evaluations;
  std::vector<std::string> overlaps;
  for (const compensation::ModelPtr& model : comparison.models) {
    const compensation::ModelInfo& info = model->info();
    std::optional<Loaded> own;
    if (!first || info.features != first->table.features) {
      auto read = load_blocks(path, info.features, &info, choice.common);
      if (!read) return tl::unexpected(read.error());
      unmatched.add(read->recording);
      (first ? own : first) = std::move(*read);
    } else if (auto same = check_gyro(path, first->recording, info, choice.common); !same) {
      return same;
    }
    const Loaded& loaded = own ? *own : *first;
    if (choice.recordings.size() > 1) {
      if (auto usable = check_usable(loaded, false); !usable) return usable;
    }
    auto evaluated = analysis::evaluate_model(model, loaded.table, correction, choice.common.used_divisor());
    if (!evaluated) return tl::unexpected(evaluated.error());
    evaluations.push_back(std::move(*evaluated));
    overlaps.push_back(recordings::overlap_text(info.provenance_json, loaded.recording, loaded.table));
  }
  for (std::size_t m = 0; m < overlaps.size(); ++m) {
    if (overlaps[m].empty()) continue;
    comparison.overlaps[comparison.candidates[m]].push_back(first->table.name);
    if (comparison.overlap.empty()) comparison.overlap = overlaps[m];
  }
  first->table.seconds = {};
  comparison.recordings.push_back(std::move(*first));
  comparison.evaluations.push_back(std::move(evaluations));
  return {};
}

Result<void> compare_models(const CompareChoice& choice, Comparison& comparison) {
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  comparison.candidates = short_names(choice.models);
  for (const std::string& path : choice.models) {
    auto model = load_model(path);
    if (!model) return tl::unexpected(model.error());
    comparison.models.push_back(std::move(*model));
  }
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  auto done = for_each_recording(choice, comparison, [&](const std::string& path) {
    return evaluate_models(path, choice, *correction, unmatched, comparison);
  });
  return done ? unmatched.finish() : done;
}

/// The samples of all recordings but `without`.
training::TrainingData samples_of(const Comparison& comparison, const std::vector<std::string>& inputs,
                                  std::size_t without = std::numeric_limits<std::size_t>::max()) {
  training::TrainingData data;
  data.names = inputs;
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    if (r != without) recordings::append_blocks(comparison.recordings[r].table, data);
  }
  return data;
}

/// Reads the recordings of one gyro, axis by axis of its features.
Result<void> read_all(const CompareChoice& choice, const compensation::FeatureDefinition& features,
                      Comparison& comparison) {
  recordings::UnmatchedRanges unmatched(choice.common.source.leave_out);
  comparison.recordings.clear(), comparison.left_out.clear();
  auto done = for_each_recording(choice, comparison, [&](const std::string& path) -> Result<void> {
    auto loaded = load_blocks(path, features, nullptr, choice.common);
    if (!loaded) return tl::unexpected(loaded.error());
    unmatched.add(loaded->recording);
    if (auto usable = check_usable(*loaded, true); !usable) return usable;
    for (const char* key : {"gyro_serial", "axis"}) {
      const std::string found = loaded->recording.value(key),
                        expected =
                            comparison.recordings.empty() ? found : comparison.recordings.front().recording.value(key);
      if (found != expected)
        return make_error(path, fmt::format("found {} \"{}\", expected \"{}\" as in the others", key, found, expected));
    }
    loaded->table.seconds = {};
    comparison.recordings.push_back(std::move(*loaded));
    return {};
  });
  return done ? unmatched.finish() : done;
}

/// Trains each method on all recordings but one, and evaluates it on that one.
Result<void> leave_one_out(const CompareChoice& choice, Comparison& comparison) {
  const auto correction = correction_settings(choice.common);
  if (!correction) return tl::unexpected(correction.error());
  const std::vector<std::string> inputs = tables::list_items(choice.inputs);
  std::vector<training::TrainingSettings> methods;
  for (const std::string& name : choice.models) {
    MethodOptions options;
    options.method = name;
    auto settings = settings_of(options);
    if (!settings) return tl::unexpected(settings.error());
    const auto terms = training::second_order_terms(inputs.size());
    if (auto good = set_terms(options, inputs, terms, {"T", "T^2", "dTdt"}, *settings); !good) return good;
    settings->stop = stop_on_interrupt();
    settings->progress = progress_bar(choice.common.quiet);
    methods.push_back(std::move(*settings));
  }
  comparison.candidates = choice.models;
  compensation::FeatureDefinition features = choice.window.window();
  if (auto good = read_all(choice, features, comparison); !good) return good;
  // One thermometer, one response: that of all recordings.
  const auto response = training::find_response(samples_of(comparison, inputs), methods.front(), features.length_s);
  if (response && response->tau_s > 0) {
    features.response_s[compensation::kInputTemperature] = response->tau_s;
    if (auto good = read_all(choice, features, comparison); !good) return good;
  }
  if (comparison.recordings.size() < 2)
    return make_error("--leave-one-out", fmt::format("found {} that can be used, expected 2 or more",
                                                     counted(comparison.recordings.size(), "recording")));
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    Evaluations& evaluations = comparison.evaluations.emplace_back();
    const recordings::BlockTable& table = comparison.recordings[r].table;
    const training::TrainingData data = samples_of(comparison, inputs, r);
    for (const training::TrainingSettings& settings : methods) {
      compensation::ModelInfo info;
      info.features = features;
      auto trained = training::train(data, std::move(info), settings);
      end_progress();
      if (!trained) return make_error(fmt::format("without {}", table.name), trained.error().text());
      auto evaluated = analysis::evaluate_model(trained->model, table, *correction, choice.common.used_divisor());
      if (!evaluated) return tl::unexpected(evaluated.error());
      evaluations.push_back(std::move(*evaluated));
    }
  }
  return {};
}

/// The improvements of a candidate, one per recording, %; kUnknown if none is defined.
std::vector<double> improvements(const Comparison& comparison, std::size_t m) {
  std::vector<double> percent;
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r)
    percent.push_back(100 * comparison.stability(r, m).improvement.value_or(kUnknown));
  return percent;
}

std::vector<double> known_values(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  return values;
}

double mean_of(const std::vector<double>& percent) {
  const std::vector<double> known = known_values(percent);
  return known.empty() ? -INFINITY : evaluation::mean_interval(known).mean;
}

/// Of the candidate with the largest mean improvement.
std::size_t best_of(const Comparison& comparison) {
  std::size_t best = 0;
  for (std::size_t m = 1; m < comparison.candidates.size(); ++m) {
    if (mean_of(improvements(comparison, m)) > mean_of(improvements(comparison, best))) best = m;
  }
  return best;
}

/// The best candidate against each other: "composite is better than stepwise by 4.1 points (1.2 to 7.0) over 12
/// recordings; ir-lssvm: not distinguishable".
std::string verdict(const Comparison& comparison) {
  const std::size_t best = best_of(comparison), count = comparison.recordings.size();
  const std::string& name = comparison.candidates[best];
  std::vector<std::string> better, alike;
  for (std::size_t m = 0; m < comparison.candidates.size(); ++m) {
    if (m == best) continue;
    if (count == 1) {
      const Cell cell = analysis::difference_cell(comparison.evaluations[0][m], comparison.evaluations[0][best],
                                                  comparison.recordings[0].table);
      const bool differs = cell.text.ends_with("better");
      (differs ? better : alike)
          .push_back(differs ? fmt::format("{} by {} points", comparison.candidates[m],
                                           cell.text.substr(0, cell.text.find(':')))
                             : comparison.candidates[m]);
      continue;
    }
    std::vector<double> points = improvements(comparison, best);
    const std::vector<double> others = improvements(comparison, m);
    for (std::size_t r = 0; r < count; ++r) points[r] -= others[r];
    points = known_values(std::move(points));
    const evaluation::MeanInterval gain =
        points.empty() ? evaluation::MeanInterval{0, -INFINITY, INFINITY} : evaluation::mean_interval(points);
    if (gain.low > 0)
      better.push_back(fmt::format("{} by {:.1f} points ({:.1f} to {:.1f})", comparison.candidates[m], gain.mean,
                                   gain.low, gain.high));
    else
      alike.push_back(comparison.candidates[m]);
  }
  std::string text;
  if (!better.empty()) text = fmt::format("{} is better than {}", name, fmt::join(better, " and "));
  if (!alike.empty())
    text += fmt::format("{}{}: not distinguishable{}", text.empty() ? "" : "; ", fmt::join(alike, ", "),
                        better.empty() ? fmt::format(" from {}", name) : "");
  if (text.empty()) text = fmt::format("{}: {:.1f} % in the mean", name, mean_of(improvements(comparison, best)));
  return fmt::format("{}, over {}.", text, counted(count, "recording"));
}

/// One row per recording, one column per candidate; then mean, worst and wins.
report::Table comparison_table(const Comparison& comparison, evaluation::Divisor divisor) {
  report::Table table{"comparison", "Improvement of each recording", "",
                      report::columns("recording: | before [deg/h]")};
  table.caption = fmt::format(
      "Improvement of the bias stability (1 sigma of {} s means, divisor {}). Wins: recordings in which it is the "
      "largest.",
      comparison.recordings.front().table.features.length_s, evaluation::divisor_text(divisor));
  const std::size_t width = std::max<std::size_t>(8, 60 / comparison.candidates.size());
  for (const std::string& name : comparison.candidates) table.columns.emplace_back(shortened(name, width), "%");
  std::vector<std::size_t> wins(comparison.candidates.size());
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    const std::vector<analysis::ModelEvaluation>& row = comparison.evaluations[r];
    const auto after = [&](std::size_t m) { return row[m].stability.after.sd; };
    std::size_t best = 0;
    for (std::size_t m = 1; m < row.size(); ++m) best = after(m) < after(best) ? m : best;
    ++wins[best];
    std::vector<Cell> cells = {shortened(comparison.recordings[r].table.name, 28),
                               report::fixed_cell(row.front().stability.before.sd, 5)};
    for (std::size_t m = 0; m < row.size(); ++m) {
      const auto& improvement = row[m].stability.improvement;
      const bool worse = improvement && *improvement < 0;
      cells.push_back(report::percent_cell(improvement, m == best && !worse ? Emphasis::kBest
                                                        : worse             ? Emphasis::kBad
                                                                            : Emphasis::kNone));
    }
    table.rows.push_back(std::move(cells));
  }
  std::vector<Cell> mean = {"mean", ""}, worst = {"worst", ""}, won = {"wins", ""};
  for (std::size_t m = 0; m < wins.size(); ++m) {
    const std::vector<double> known = known_values(improvements(comparison, m));
    const bool none = known.empty();
    mean.push_back(report::percent_cell(none ? std::nullopt : std::optional(mean_of(known) / 100)));
    worst.push_back(report::percent_cell(none ? std::nullopt : std::optional(std::ranges::min(known) / 100)));
    won.push_back(report::count_cell(wins[m]));
  }
  if (comparison.recordings.size() > 1) table.rows.insert(table.rows.end(), {mean, worst, won});
  table.meaning = verdict(comparison);
  return table;
}

/// One row per candidate and recording. "Against the first": the first candidate.
report::Table pairs_table(const Comparison& comparison) {
  report::Table table{"pairs", "Each model on each recording", "",
                      report::columns("recording: | model: | before [deg/h] | after [deg/h] | improvement [%] | "
                                      "95 % of further [%] | against the first [points] | off [%]")};
  table.caption =
      "95 % of further: 95 % prediction interval of the improvement in another recording of the same profile. Against "
      "the first: the same interval for the difference to the first model. Off: blocks outside the training range.";
  std::size_t better = 0;
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    for (std::size_t m = 0; m < comparison.candidates.size(); ++m) {
      const analysis::ModelEvaluation& evaluated = comparison.evaluations[r][m];
      const evaluation::BiasStability& s = evaluated.stability;
      const recordings::BlockTable& blocks = comparison.recordings[r].table;
      better += s.improvement && *s.improvement > 0;
      table.rows.push_back(
          {blocks.name, comparison.candidates[m], report::fixed_cell(s.before.sd, 5), report::fixed_cell(s.after.sd, 5),
           report::percent_cell(s.improvement), analysis::interval_text(evaluated.improvement_interval),
           m == 0 ? Cell(report::kNothing) : analysis::difference_cell(comparison.evaluations[r][0], evaluated, blocks),
           report::fixed_cell(evaluated.extrapolated_percent(), 1)});
    }
  }
  table.meaning = fmt::format("{} of {} improve the recording.", better, counted(table.rows.size(), "pair"));
  return table;
}

report::Table left_out_table(const Comparison& comparison) {
  report::Table table{"left_out", "Recordings that were left out", "", report::columns("recording: | reason:")};
  for (const auto& [path, reason] : comparison.left_out) table.rows.push_back({path, reason});
  table.meaning = counted(table.rows.size(), "recording") + " of all.";
  return table;
}

Result<int> compare(const CompareChoice& choice) {
  Comparison comparison;
  auto done = choice.leave_one_out ? leave_one_out(choice, comparison) : compare_models(choice, comparison);
  if (!done) return tl::unexpected(done.error());
  report::Report report;
  report.title = choice.leave_one_out ? "Comparison of methods" : "Comparison of models";
  report.subtitle =
      fmt::format("{} on {}", counted(comparison.candidates.size(), choice.leave_one_out ? "method" : "model"),
                  counted(comparison.recordings.size(), "recording"));
  report.tool = std::string("prismcal ") + kVersion;
  std::vector<std::pair<std::string, const Loaded*>> all;
  for (std::size_t m = 0; m < comparison.models.size(); ++m)
    report.facts.emplace_back("model " + comparison.candidates[m],
                              comparison.models[m]->info().name + ", id " + comparison.models[m]->info().id);
  for (const Loaded& loaded : comparison.recordings) {
    append_recording_facts(report.facts, loaded, "recording " + loaded.table.name);
    report.simulated = report.simulated || is_simulated(loaded.recording, choice.common);
    all.emplace_back("evaluated", &loaded);
  }
  for (const auto& [candidate, names] : comparison.overlaps)
    add_overlap(report, fmt::format("{} for {}", fmt::join(names, ", "), candidate), comparison.overlap);
  for (std::size_t r = 0; r < comparison.recordings.size(); ++r) {
    const Loaded& loaded = comparison.recordings[r];
    add_doubts(
        report, loaded.table.name,
        analysis::recording_doubts(loaded.table, comparison.evaluations[r].front(), loaded.recording.questions()));
  }
  const report::Table table = comparison_table(comparison, choice.common.used_divisor());
  report.sections = {{"comparison", "Comparison", {table, pairs_table(comparison)}},
                     {"recordings", "Recordings", {recordings_table(all)}}};
  if (!comparison.left_out.empty()) report.sections.back().blocks.emplace_back(left_out_table(comparison));
  if (!choice.common.json) {
    for (const auto& [path, reason] : comparison.left_out) fmt::print(stderr, "left out: {}\n", printable(reason));
    if (!report.warning.empty()) fmt::print("{}\n\n", printable(report.warning));
    fmt::print("{}", report::plain_text(table));
  }
  const auto test = test_statement(choice.common);
  if (!test) return tl::unexpected(test.error());
  std::string dates;
  for (const Loaded& loaded : comparison.recordings) dates += (dates.empty() ? "" : "; ") + dates_text(loaded.table);
  fill_cover(report, {{"recordings", dates}, {"models", fmt::format("{}", comparison.models.size())}}, *test);
  if (auto written = write_report(report, choice.common); !written) return tl::unexpected(written.error());
  return 0;
}

}  // namespace

void add_compare_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("compare", "compare models, or methods, on recordings in one table");
  const auto choice = std::make_shared<CompareChoice>();
  add_options(*command,
              {{"models", &choice->models, "model files; with --leave-one-out methods"},
               {"--on", &choice->recordings, kRecordings}},
              Need::kRequired);
  add_options(*command,
              {{"--leave-one-out", &choice->leave_one_out,
                "train each method on all recordings but one, and test it on that one, in turn"},
               {"--inputs", &choice->inputs, "of --leave-one-out"},
               {"--strict", &choice->strict, "end at a recording that cannot be used; else it is left out and named"}});
  add_common_options(*command, choice->common);
  add_report_options(*command, choice->common);
  add_window_options(*command, choice->window);
  tools::add_examples(*command,
                      {"prismcal compare old.json new.json --on day1.csv day2.csv day3.csv",
                       "prismcal compare composite stepwise ir-lssvm --leave-one-out --on day*.csv --out report"});
  command->callback([choice, &code] {
    if (choice->recordings.size() > 1) choice->common.source.table.silence();  // inspect shows how each is read
    code = exit_code(compare(*choice));
  });
}

}  // namespace prism::commands
