// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/methods.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"

namespace prism::commands {
namespace {

struct FitChoice {
  std::string file, inputs, target, fold_column, time, out, diagnostics;
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

std::string provenance(const recordings::CsvTable& table, const FitChoice& choice,
                       const nlohmann::ordered_json& summary) {
  nlohmann::ordered_json json = {{"tool", fmt::format("prismcal {}", kVersion)}, {"target", choice.target}};
  json["files"] = {{{"path", table.path()}, {"sha256", table.sha256()}, {"rows", table.rows()}}};
  json["training"] = provenance_json(summary);
  return json_text(json);
}

Result<int> run(const FitChoice& choice) {
  const auto table = recordings::CsvTable::read(choice.file);
  if (!table) return tl::unexpected<Error>(table.error());
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  training::TrainingData data;
  data.names = recordings::csv_fields(choice.inputs, ',');
  if (auto good = set_terms(choice.method, data.names, training::plain_terms(data.names.size()), {}, *settings); !good)
    return tl::unexpected<Error>(good.error());
  auto inputs = table->columns(data.names);
  if (!inputs) return tl::unexpected<Error>(inputs.error());
  const auto target = table->columns({choice.target});
  if (!target) return tl::unexpected<Error>(target.error());
  data.inputs = std::move(*inputs);
  data.target = target->row(0).transpose();
  if (!choice.time.empty()) {
    const auto time = table->column(choice.time);
    if (!time) return tl::unexpected<Error>(time.error());
    if (!std::is_sorted(time->begin(), time->end()))
      return make_error("--time", "found unsorted rows, expected them in order of " + choice.time);
    data.time_s = Eigen::Map<const Eigen::VectorXd>(time->data(), data.target.size());
  }
  if (!choice.fold_column.empty()) {
    if (settings->method->has(training::kOwnSearch))
      return make_error("--fold-column",
                        fmt::format("found it with --method {}, which has no folds", settings->method->name));
    if (settings->tuning == training::Tuning::kLoo || settings->tuning == training::Tuning::kReml) {
      return make_error("--fold-column",
                        fmt::format("found it with --tune {}, which has no folds", choice.method.tune));
    }
    const auto column = table->column(choice.fold_column);
    if (!column) return tl::unexpected<Error>(column.error());
    auto folds = training::folds_from(*column);
    if (!folds) return tl::unexpected<Error>(folds.error());
    settings->given_folds = std::move(*folds);
    settings->tuning = training::Tuning::kGiven;
  }
  const auto plan = training::plan_resources(data.inputs.cols(), data.inputs.rows(), *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (!choice.method.quiet && !choice.method.json && plan->seconds > 0.5) fmt::print(stderr, "{}\n", plan->text());
  compensation::ModelInfo info;
  info.table = true;
  auto trained =
      training::train(data, std::move(info), *settings, progress_bar(choice.method.quiet), stop_on_interrupt());
  end_progress();
  if (!trained) return tl::unexpected<Error>(trained.error());
  const auto summary = summary_json(*trained, *settings, data.names);
  if (!choice.out.empty()) {
    const std::string text = compensation::format_model(*trained->model, provenance(*table, choice, summary));
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
  command->add_option("table", choice->file, "CSV with a line of names")->required();
  command->add_option("--inputs", choice->inputs, "columns, separated by commas")->required();
  command->add_option("--target", choice->target, "column to predict")->required();
  command->add_option("--fold-column", choice->fold_column, "column of fold numbers, for tuning");
  command->add_option("--time", choice->time, "composite: column of seconds (default: rows 100 s apart)");
  command->add_option("--out", choice->out, "model file to write");
  command->add_option("--diagnostics", choice->diagnostics,
                      "CSV to write: alpha, weight, fitted, leave-one-out residual of each row");
  add_method_options(*command, choice->method);
  tools::add_examples(*command, {"prismcal fit table.csv --inputs x1,x2 --target y --method lssvm --out model.json"});
  command->callback([choice, &code] {
    if (!choice->fold_column.empty() && choice->method.method.empty())
      choice->method.method = training::default_method(true).name;
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
