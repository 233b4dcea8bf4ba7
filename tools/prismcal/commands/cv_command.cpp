// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/plain_text.hpp"
#include "compensation/kernel.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/trainer.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/commands/recording_options.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"

namespace prism::commands {
namespace {

constexpr Eigen::Index kMaxRefined =
    2000;  // up to this number of samples, solves are refined, so that all machines give the same result

struct CvChoice {
  std::string file, inputs, target, fold_column;
  tables::TableOptions table;
  MethodOptions method;
};

nlohmann::ordered_json costs_json(const training::CrossValidation& cv) {
  nlohmann::ordered_json json = {{"mse", cv.mse}, {"mae", cv.mae}};
  if (cv.fold_mse.empty()) return json;
  json["fold_mse"] = cv.fold_mse;
  json["fold_mae"] = cv.fold_mae;
  return json;
}

std::string costs_text(const char* name, const training::CrossValidation& cv) {
  std::string text = fmt::format("{}: mse {:.6g}, mae {:.6g}\n", name, cv.mse, cv.mae);
  for (std::size_t i = 0; i < cv.fold_mae.size(); ++i)
    text += fmt::format("  fold {:>2}: mse {:.6g}, mae {:.6g}\n", i + 1, cv.fold_mse[i], cv.fold_mae[i]);
  return text;
}

struct Problem {
  training::NormalisedData data;
  training::Folds folds;
};

Result<Problem> read_problem(const CvChoice& choice, const training::TrainingSettings& settings) {
  tables::TableOptions options = choice.table;
  if (choice.method.quiet) options.silence();
  std::vector<std::string> names = recordings::csv_fields(choice.inputs, ',');
  const auto d = static_cast<Eigen::Index>(names.size());
  names.push_back(choice.target);
  if (!choice.fold_column.empty()) names.push_back(choice.fold_column);
  auto columns = recordings::read_csv_columns(choice.file, names, options);
  if (!columns) return tl::unexpected<Error>(columns.error());
  if (const std::size_t dropped = columns->drop_holes(); dropped > 0 && !choice.method.quiet)
    fmt::print(stderr, "{}: {} with a hole left out\n", choice.file, counted(dropped, "row"));
  names.resize(static_cast<std::size_t>(d));
  auto data = training::normalise({names, columns->values.topRows(d), columns->values.row(d).transpose(), {}, {}},
                                  settings.scaling);
  if (!data) return tl::unexpected<Error>(data.error());
  const auto n = static_cast<std::size_t>(columns->values.cols());
  if (choice.fold_column.empty()) {
    if (static_cast<std::size_t>(settings.folds) > n)
      return make_error("--folds", fmt::format("found {}, expected at most {} rows", settings.folds, n));
    const bool shuffled = settings.tuning == training::Tuning::kShuffled;
    return Problem{std::move(*data), shuffled ? training::shuffled_folds(n, settings.folds, settings.seed)
                                              : training::blocked_folds(std::vector<int>(n, 0), settings.folds)};
  }
  const Eigen::VectorXd column = columns->values.bottomRows(1).transpose();
  auto folds = training::folds_from({column.begin(), column.end()});
  if (!folds) return tl::unexpected<Error>(folds.error());
  return Problem{std::move(*data), std::move(*folds)};
}

Result<int> run(const CvChoice& choice) {
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  if (!settings->method->has(training::kExactFolds)) {
    return make_error("--method", fmt::format("found \"{}\", expected {}", settings->method->name,
                                              training::method_names(training::kExactFolds, " or ")));
  }
  if (!settings->c || !settings->sigma2)
    return make_error("--c and --sigma2", "found one or none of them, expected both");
  const auto problem = read_problem(choice, *settings);
  if (!problem) return tl::unexpected<Error>(problem.error());
  const training::NormalisedData& data = problem->data;
  const auto fits = training::plan_resources(data.y.size(), data.x.rows(), *settings);
  if (!fits) return tl::unexpected<Error>(fits.error());
  if (fits->sparse)
    return make_error(choice.file,
                      fmt::format("found {} rows, expected at most 5000 for exact cross-validation", data.y.size()));
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(data.x, {*settings->sigma2});
  const double scale = data.constants.target_scale;
  const bool loo = settings->tuning == training::Tuning::kLoo;
  const training::Folds folds = loo ? training::Folds() : problem->folds;
  const auto plain = training::cross_validate(kernel, data.y, *settings->c, folds, scale);
  if (!plain) return tl::unexpected<Error>(plain.error());
  nlohmann::ordered_json json = costs_json(*plain);
  std::string text = costs_text("unweighted", *plain);
  if (settings->method->has(training::kWeights)) {
    if (loo) return make_error("--tune", "found loo with " + std::string(settings->method->name) + ", expected folds");
    training::ReweightSettings reweight = settings->reweight;
    reweight.weight.parameter = settings->parameter.value_or(training::usual_parameter(reweight.weight.kind));
    if (reweight.limit > 1) reweight.limit = training::kRobustSolves, reweight.tolerance = 0;
    training::ExtendedMatrix extended;
    if (data.y.size() <= kMaxRefined)
      reweight.extended = &(extended = training::extended_kernel_matrix(data.x, *settings->sigma2));
    const auto robust = training::cross_validate_robust(kernel, data.y, *settings->c, reweight, folds, scale);
    if (!robust) return tl::unexpected<Error>(robust.error());
    json = costs_json(*robust);
    json["fold_solves"] = robust->fold_solves;
    json["weight"] = training::weight_name(reweight.weight.kind);
    json["unweighted"] = costs_json(*plain);
    json["weighted"] = costs_json(*robust);
    text += costs_text(training::weight_name(reweight.weight.kind), *robust);
  } else {
    json["unweighted"] = costs_json(*plain);
  }
  fmt::print("{}", choice.method.json ? json_text(json, 2) + "\n" : text);
  return 0;
}

}  // namespace

void add_cv_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("cv", "cross-validation errors of an LSSVM on a CSV table");
  const auto choice = std::make_shared<CvChoice>();
  choice->method.tune = "shuffled";
  command->add_option("table", choice->file, "plain table with a line of names")->required();
  command->add_option("--inputs", choice->inputs, "columns, separated by commas")->required();
  command->add_option("--target", choice->target, "column to predict")->required();
  command->add_option("--fold-column", choice->fold_column, "column of fold numbers");
  add_table_options(*command, choice->table);
  add_method_options(*command, choice->method);
  tools::add_examples(*command, {"prismcal cv table.csv --inputs x1,x2 --target y --c 10 --sigma2 0.5 --weight huber"});
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
