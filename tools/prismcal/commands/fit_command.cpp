// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/trainer.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/commands/progress_bars.hpp"
#include "tools/prismcal/commands/recording_options.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"

namespace prism::commands {
namespace {

struct FitChoice {
  std::string file, inputs, target, fold_column, time, out, diagnostics;
  tables::TableOptions table;
  MethodOptions method;
};

std::string diagnostics_csv(const training::SampleDiagnostics& d) {
  std::string text = "alpha,weight,fitted,loo_residual\n";
  const auto value = [](const Eigen::VectorXd& v, Eigen::Index i) {
    return i < v.size() && std::isfinite(v[i]) ? fmt::format("{}", v[i]) : "";
  };
  for (Eigen::Index i = 0; i < d.fitted.size(); ++i) {
    text += fmt::format("{},{},{},{}\n", value(d.alpha, i), value(d.weight, i), value(d.fitted, i),
                        value(d.leave_one_out, i));
  }
  return text;
}

std::string provenance(const std::string& sha256, Eigen::Index rows, const FitChoice& choice,
                       const nlohmann::ordered_json& summary) {
  nlohmann::ordered_json json = {{"tool", fmt::format("prismcal {}", kVersion)}, {"target", choice.target}};
  json["files"] = {{{"path", choice.file}, {"sha256", sha256}, {"rows", rows}}};
  json["training"] = provenance_json(summary);
  return json_text(json);
}

Result<int> run(const FitChoice& choice) {
  tables::TableOptions options = choice.table;
  if (choice.method.quiet) options.silence();
  const auto sha256 = sha256_of_file(choice.file);
  if (!sha256) return tl::unexpected<Error>(sha256.error());
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  training::TrainingData data;
  data.names = recordings::csv_fields(choice.inputs, ',');
  if (auto good = set_terms(choice.method, data.names, training::plain_terms(data.names.size()), {}, *settings); !good)
    return tl::unexpected<Error>(good.error());
  std::vector<std::string> names = data.names;
  names.push_back(choice.target);
  if (!choice.time.empty()) names.push_back(choice.time);
  if (!choice.fold_column.empty()) names.push_back(choice.fold_column);
  auto columns = recordings::read_csv_columns(choice.file, names, options, false, choice.time);
  if (!columns) return tl::unexpected<Error>(columns.error());
  if (const std::size_t dropped = columns->drop_holes(); dropped > 0 && !choice.method.quiet)
    fmt::print(stderr, "{}: {} with a hole left out\n", choice.file, counted(dropped, "row"));
  // Below four rows in each fold, a tuning is decided by chance.
  const bool tuned = settings->method->has(training::kOwnSearch) || settings->method->has(training::kTuning);
  if (const auto least = 4 * static_cast<Eigen::Index>(settings->folds);
      tuned && !(settings->c && settings->sigma2) && choice.fold_column.empty() && columns->values.cols() < least)
    return make_error(choice.file,
                      fmt::format("found {}, expected {} or more",
                                  counted(static_cast<std::size_t>(columns->values.cols()), "row"), least));
  const auto d = static_cast<Eigen::Index>(data.names.size());
  data.inputs = columns->values.topRows(d);
  data.target = columns->values.row(d).transpose();
  if (!choice.time.empty()) data.time_s = columns->values.row(d + 1).transpose();
  if (!choice.fold_column.empty()) {
    if (settings->method->has(training::kOwnSearch))
      return make_error("--fold-column",
                        fmt::format("found it with --method {}, which has no folds", settings->method->name));
    if (settings->tuning == training::Tuning::kLoo || settings->tuning == training::Tuning::kReml) {
      return make_error("--fold-column",
                        fmt::format("found it with --tune {}, which has no folds", choice.method.tune));
    }
    const Eigen::VectorXd column = columns->values.bottomRows(1).transpose();
    auto folds = training::folds_from({column.begin(), column.end()});
    if (!folds) return tl::unexpected<Error>(folds.error());
    settings->given_folds = std::move(*folds);
    settings->tuning = training::Tuning::kGiven;
  }
  const auto plan = training::plan_resources(data.inputs.cols(), data.inputs.rows(), *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (!choice.method.quiet && !choice.method.json && plan->seconds > 0.5) fmt::print(stderr, "{}\n", plan->text());
  compensation::ModelInfo info;
  info.table = true;
  settings->progress = progress_bar(choice.method.quiet);
  settings->stop = stop_on_interrupt();
  auto trained = training::train(data, std::move(info), *settings);
  end_progress();
  if (!trained) return tl::unexpected<Error>(trained.error());
  if (*stop_on_interrupt()) fmt::print(stderr, "prismcal: {}\n", kStoppedEarly);
  const auto summary = summary_json(*trained, *settings, data.names);
  if (!choice.out.empty()) {
    const std::string text =
        compensation::format_model(*trained->model, provenance(*sha256, data.target.size(), choice, summary));
    if (auto done = write_text_file(choice.out, text); !done) return tl::unexpected<Error>(done.error());
  }
  if (!choice.diagnostics.empty()) {
    if (auto done = write_text_file(choice.diagnostics, diagnostics_csv(trained->samples)); !done)
      return tl::unexpected<Error>(done.error());
  }
  fmt::print("{}", choice.method.json ? json_text(summary, 2) + "\n" : summary_text(*trained, *settings, data.names));
  return 0;
}

}  // namespace

void add_fit_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("fit", "train a model on a CSV table with any inputs and target");
  const auto choice = std::make_shared<FitChoice>();
  command->add_option("table", choice->file, "plain table with a line of names")->required();
  command->add_option("--inputs", choice->inputs, "columns, separated by commas")->required();
  command->add_option("--target", choice->target, "column to predict")->required();
  command->add_option("--fold-column", choice->fold_column, "column of fold numbers, for tuning");
  command->add_option("--time", choice->time, "composite: column of seconds (default: rows 100 s apart)");
  command->add_option("--out", choice->out, "model file to write");
  command->add_option("--diagnostics", choice->diagnostics,
                      "CSV to write: alpha, weight, fitted, leave-one-out residual of each row");
  add_table_options(*command, choice->table);
  add_method_options(*command, choice->method);
  tools::add_examples(*command, {"prismcal fit table.csv --inputs x1,x2 --target y --method lssvm --out model.json"});
  command->callback([choice, &code] {
    if (!choice->fold_column.empty() && choice->method.method.empty()) choice->method.method = kDefaultTuned;
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
