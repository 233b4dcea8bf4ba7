// SPDX-License-Identifier: MIT
// The commands fit, cv and predict: any plain table of numbers.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "compensation/extrapolation.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model_text.hpp"
#include "compensation/training/lssvm.hpp"
#include "compensation/training/trainer.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/method_options.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace prism::commands {
namespace {

struct TableChoice {
  std::string file, inputs, target, fold_column, time, out, diagnostics;
  tables::TableOptions table;
  MethodOptions method;
};

struct TableData {
  training::TrainingData data;
  std::optional<training::Folds> folds;  ///< of the fold column
};

/// Values of several columns.
struct CsvColumns {
  Eigen::MatrixXd values;         ///< one row per column of the table (d × N); a hole is kUnknown
  std::vector<std::string> text;  ///< the rows as in the file; only if asked for
  std::string header;             ///< the names as in the file, with its separator
  char separator = ',', decimal = '.';
};

/// Reads columns by name or number. A column whose header states a unit in brackets or in a row of units is converted
/// to deg/h, degC, V or s. Announces how the table was understood. `time`: the one of `names` that is a time, in
/// seconds; empty: none. Errors, with line and column: those of PlainTable.
Result<CsvColumns> read_csv_columns(const std::string& path, const std::vector<std::string>& names,
                                    const tables::TableOptions& options, bool keep_text, const std::string& time = {}) {
  auto table = tables::PlainTable::open(path, options);
  if (!table) return tl::unexpected<Error>(table.error());
  tables::Selection selection;
  selection.keep_text = keep_text;
  std::size_t time_place = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto index = table->find(names[i]);
    if (!index) return tl::unexpected<Error>(index.error());
    if (names[i] == time && !selection.time) {
      time_place = i;
      const bool has_unit = table->columns()[*index].unit || !options.time_unit.empty();
      selection.time = tables::TimeSelection{*index, has_unit ? "" : "s"};
    } else {
      selection.numbers.push_back(*index);
    }
  }
  if (auto good = table->select(selection); !good) return tl::unexpected<Error>(good.error());
  std::vector<double> values;
  CsvColumns columns;
  tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) break;
    auto value = row.values.begin();
    auto column = selection.numbers.begin();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const tables::Header& header = table->columns()[i == time_place ? 0 : *column];
      if (i == time_place)
        values.push_back(static_cast<double>(row.time_ns) / 1e9);
      else if (++column; header.stated)
        values.push_back(*value++ * header.unit->factor + header.unit->offset);
      else
        values.push_back(*value++);
    }
    if (keep_text) columns.text.push_back(row.text);
  }
  columns.values = Eigen::Map<const Eigen::MatrixXd>(values.data(), static_cast<Eigen::Index>(names.size()),
                                                     static_cast<Eigen::Index>(table->rows()));
  columns.separator = table->separator();
  columns.decimal = table->decimal();
  for (const tables::Header& header : table->columns())
    columns.header += (columns.header.empty() ? "" : std::string(1, columns.separator)) + header.text;
  if (options.announce) options.announce(table->understood());
  return columns;
}

/// The columns of a choice, without the rows that have a hole.
Result<TableData> read_table(const TableChoice& choice) {
  tables::TableOptions options = choice.table;
  if (choice.method.quiet) options.silence();
  TableData read;
  read.data.names = tables::list_items(choice.inputs);
  const auto d = static_cast<Eigen::Index>(read.data.names.size());
  std::vector<std::string> names = read.data.names;
  for (const std::string& name : {choice.target, choice.time, choice.fold_column}) {
    if (!name.empty()) names.push_back(name);
  }
  const auto columns = read_csv_columns(choice.file, names, options, false, choice.time);
  if (!columns) return tl::unexpected<Error>(columns.error());
  std::vector<Eigen::Index> known;
  for (Eigen::Index i = 0; i < columns->values.cols(); ++i) {
    if (columns->values.col(i).allFinite()) known.push_back(i);
  }
  const Eigen::MatrixXd values = columns->values(Eigen::all, known);
  if (const Eigen::Index dropped = columns->values.cols() - values.cols(); dropped > 0 && !choice.method.quiet)
    fmt::print(stderr, "{}: {} with a hole left out\n", choice.file, counted(static_cast<std::size_t>(dropped), "row"));
  read.data.inputs = values.topRows(d);
  read.data.target = values.row(d).transpose();
  if (!choice.time.empty()) read.data.time_s = values.row(d + 1).transpose();
  if (choice.fold_column.empty()) return read;
  const Eigen::VectorXd column = values.bottomRows(1).transpose();
  auto folds = training::folds_from({column.begin(), column.end()});
  if (!folds) return tl::unexpected<Error>(folds.error());
  read.folds = std::move(*folds);
  return read;
}

void add_options_of_a_table(CLI::App& command, TableChoice& choice, const char* folds_help) {
  choice.method.table = true;
  add_options(command,
              {{"table", &choice.file, "plain table with a line of names"},
               {"--inputs", &choice.inputs, "columns, separated by commas"},
               {"--target", &choice.target, "column to predict"}},
              Need::kRequired);
  add_options(command, {{"--fold-column", &choice.fold_column, folds_help}});
  add_table_options(command, choice.table);
}

// fit

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

Result<void> set_folds(const TableChoice& choice, std::optional<training::Folds> folds,
                       training::TrainingSettings& settings) {
  if (!folds) return {};
  if (settings.method->has(training::kOwnSearch))
    return make_error("--fold-column",
                      fmt::format("found it with --method {}, which has no folds", settings.method->name));
  if (settings.tuning == training::Tuning::kLoo || settings.tuning == training::Tuning::kReml)
    return make_error("--fold-column", fmt::format("found it with --tune {}, which has no folds", choice.method.tune));
  settings.given_folds = std::move(folds);
  settings.tuning = training::Tuning::kGiven;
  return {};
}

std::string provenance(const std::string& sha256, Eigen::Index rows, const TableChoice& choice,
                       const nlohmann::ordered_json& summary) {
  nlohmann::ordered_json json = {{"tool", fmt::format("prismcal {}", kVersion)}, {"target", choice.target}};
  json["files"] = {{{"path", choice.file}, {"sha256", sha256}, {"rows", rows}}};
  json["training"] = provenance_json(summary);
  return json_text(json);
}

Result<int> fit(const TableChoice& stated) {
  TableChoice choice = stated;
  if (!choice.fold_column.empty() && choice.method.method.empty()) choice.method.method = kDefaultTuned;
  const auto sha256 = sha256_of_file(choice.file);
  if (!sha256) return tl::unexpected<Error>(sha256.error());
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  const std::vector<std::string> names = tables::list_items(choice.inputs);
  if (auto good = set_terms(choice.method, names, *settings); !good) return tl::unexpected<Error>(good.error());
  auto read = read_table(choice);
  if (!read) return tl::unexpected<Error>(read.error());
  const training::TrainingData& data = read->data;
  // Below four rows in each fold, a tuning is decided by chance.
  const bool tuned = settings->method->has(training::kOwnSearch) || settings->method->has(training::kTuning);
  if (const auto least = 4 * static_cast<Eigen::Index>(settings->folds);
      tuned && !(settings->c && settings->sigma2) && !read->folds && data.target.size() < least)
    return make_error(choice.file, fmt::format("found {}, expected {} or more",
                                               counted(static_cast<std::size_t>(data.target.size()), "row"), least));
  if (auto good = set_folds(choice, std::move(read->folds), *settings); !good)
    return tl::unexpected<Error>(good.error());
  const auto plan = training::plan_resources(data.inputs.cols(), data.inputs.rows(), *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (!choice.method.quiet && !choice.method.json && plan->seconds > 0.5) fmt::print(stderr, "{}\n", plan->text());
  compensation::ModelInfo info;
  info.table = true;
  settings->progress = progress_line(choice.method.quiet);
  settings->stop = stop_on_interrupt();
  auto trained = training::train(data, std::move(info), *settings);
  end_progress();
  if (!trained) return tl::unexpected<Error>(trained.error());
  if (*stop_on_interrupt()) fmt::print(stderr, "prismcal: {}\n", kStoppedEarly);
  const Summary summary = summary_of(*trained, *settings, names);
  if (!choice.out.empty()) {
    const std::string text =
        compensation::format_model(*trained->model, provenance(*sha256, data.target.size(), choice, summary.json));
    if (auto done = write_text_file(choice.out, text); !done) return tl::unexpected<Error>(done.error());
  }
  if (!choice.diagnostics.empty()) {
    if (auto done = write_text_file(choice.diagnostics, diagnostics_csv(trained->samples)); !done)
      return tl::unexpected<Error>(done.error());
  }
  fmt::print("{}", choice.method.json ? json_text(summary.json, 2) + "\n" : summary.text);
  return 0;
}

// cv

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

Result<int> cross_validate(const TableChoice& choice) {
  // Up to this number of samples, solves are refined, so that all machines give the same result.
  constexpr Eigen::Index kMaxRefined = 2000;
  const auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  if (!settings->method->has(training::kExactFolds))
    return make_error("--method", fmt::format("found \"{}\", expected {}", settings->method->name,
                                              training::method_names(training::kExactFolds, " or ")));
  if (!settings->c || !settings->sigma2)
    return make_error("--c and --sigma2", "found one or none of them, expected both");
  auto read = read_table(choice);
  if (!read) return tl::unexpected<Error>(read.error());
  const auto data = training::normalise(read->data, settings->scaling);
  if (!data) return tl::unexpected<Error>(data.error());
  const auto n = static_cast<std::size_t>(data->y.size());
  if (!read->folds && static_cast<std::size_t>(settings->folds) > n)
    return make_error("--folds", fmt::format("found {}, expected at most {} rows", settings->folds, n));
  const auto fits = training::plan_resources(data->y.size(), data->x.rows(), *settings);
  if (!fits) return tl::unexpected<Error>(fits.error());
  if (fits->sparse)
    return make_error(choice.file, fmt::format("found {} rows, expected at most 5000 for exact cross-validation", n));
  const bool loo = settings->tuning == training::Tuning::kLoo;
  const training::Folds folds = loo           ? training::Folds()
                                : read->folds ? std::move(*read->folds)
                                : settings->tuning == training::Tuning::kShuffled
                                    ? training::shuffled_folds(n, settings->folds, settings->seed)
                                    : training::blocked_folds(std::vector<int>(n, 0), settings->folds);
  const Eigen::MatrixXd kernel = compensation::kernel_matrix(data->x, *settings->sigma2);
  const double scale = data->constants.target_scale;
  const auto plain = training::cross_validate(kernel, data->y, *settings->c, folds, scale);
  if (!plain) return tl::unexpected<Error>(plain.error());
  nlohmann::ordered_json json = costs_json(*plain);
  std::string text = costs_text("unweighted", *plain);
  if (settings->method->has(training::kWeights)) {
    if (loo) return make_error("--tune", "found loo with " + std::string(settings->method->name) + ", expected folds");
    training::ReweightSettings reweight = settings->reweight;
    reweight.weight.parameter = settings->parameter.value_or(training::usual_parameter(reweight.weight.kind));
    if (reweight.limit > 1) reweight.limit = training::kRobustSolves, reweight.tolerance = 0;
    training::ExtendedMatrix extended;
    if (data->y.size() <= kMaxRefined)
      reweight.extended = &(extended = training::extended_kernel_matrix(data->x, *settings->sigma2));
    const auto robust = training::cross_validate_robust(kernel, data->y, *settings->c, reweight, folds, scale);
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

// predict

struct PredictChoice {
  std::string model, file, out, policy = "preset";
  tables::TableOptions table;
  bool json = false, quiet = false;
};

/// With the decimal sign of the table.
std::string number(double value, const CsvColumns& columns) {
  std::string text = std::isfinite(value) ? fmt::format("{}", value) : "";
  const std::size_t point = text.find('.');
  if (point != std::string::npos) text[point] = columns.decimal;
  return text;
}

Result<int> predict(const PredictChoice& choice) {
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected<Error>(model.error());
  tables::TableOptions options = choice.table;
  if (choice.quiet) options.silence();
  const auto columns = read_csv_columns(choice.file, (*model)->info().inputs, options, true);
  if (!columns) return tl::unexpected<Error>(columns.error());
  const auto& names = compensation::kExtrapolationNames;
  const auto policy = static_cast<compensation::Extrapolation>(std::ranges::find(names, choice.policy) - names.begin());
  const char comma = columns->separator;
  std::string out = fmt::format("{}{}prediction{}sd{}sd_mean\n", columns->header, comma, comma, comma);
  std::size_t extrapolating = 0;
  for (std::size_t i = 0; i < columns->text.size(); ++i) {
    const auto input = columns->values.col(static_cast<Eigen::Index>(i));
    const std::span<const double> point(input.data(), static_cast<std::size_t>(input.size()));
    // A hole in an input: no prediction.
    const compensation::Prediction p =
        input.allFinite() ? compensation::predict_within(**model, point, policy) : compensation::Prediction();
    extrapolating += p.extrapolating ? 1 : 0;
    out += fmt::format("{}{}{}{}{}{}{}\n", columns->text[i], comma, number(p.bias_deg_per_h, *columns), comma,
                       number(p.sd_deg_per_h, *columns), comma, number(p.sd_mean_deg_per_h, *columns));
  }
  if (auto done = write_text_file(choice.out, out); !done) return tl::unexpected<Error>(done.error());
  const nlohmann::ordered_json json = {{"rows", columns->text.size()},
                                       {"extrapolating", extrapolating},
                                       {"model", (*model)->info().id},
                                       {"out", choice.out}};
  fmt::print("{}", choice.json ? json_text(json, 2) + "\n"
                               : fmt::format("{} rows, {} of them outside the training range\n", columns->text.size(),
                                             extrapolating));
  return 0;
}

}  // namespace

void add_fit_command(CLI::App& app, int& code) {
  const auto [command, choice] =
      new_command<TableChoice>(app, code, "fit", "train a model on a CSV table with any inputs and target", fit);
  add_options_of_a_table(command, choice, "column of fold numbers, for tuning");
  add_options(command, {{"--time", &choice.time, "composite: column of seconds (default: rows 100 s apart)"},
                        {"--out", &choice.out, "model file to write"},
                        {"--diagnostics", &choice.diagnostics,
                         "CSV to write: alpha, weight, fitted, leave-one-out residual of each row"}});
  add_method_options(command, choice.method);
  tools::add_examples(command, {"prismcal fit table.csv --inputs x1,x2 --target y --method lssvm --out model.json"});
}

void add_cv_command(CLI::App& app, int& code) {
  const auto [command, choice] =
      new_command<TableChoice>(app, code, "cv", "cross-validation errors of an LSSVM on a CSV table", cross_validate);
  choice.method.tune = "shuffled";
  add_options_of_a_table(command, choice, "column of fold numbers");
  add_method_options(command, choice.method);
  tools::add_examples(command, {"prismcal cv table.csv --inputs x1,x2 --target y --c 10 --sigma2 0.5 --weight huber"});
}

void add_predict_command(CLI::App& app, int& code) {
  const auto [command, choice] =
      new_command<PredictChoice>(app, code, "predict", "apply a model to the rows of a CSV table", predict);
  const auto& names = compensation::kExtrapolationNames;
  add_options(command,
              {{"model", &choice.model, "model file"},
               {"table", &choice.file, "table with columns named as the inputs of the model"},
               {"--out", &choice.out, "CSV to write: the table's columns, prediction and sd"}},
              Need::kRequired);
  add_options(command, {{"--extrapolation", &choice.policy, "preset, flag, clamp or shrink",
                         one_of({names.begin(), names.end()})}});
  add_table_options(command, choice.table);
  add_options(command, {{"--json", &choice.json, "print JSON"}, {"--quiet", &choice.quiet, "no remarks on stderr"}});
  tools::add_examples(command, {"prismcal predict model.json table.csv --out predicted.csv"});
}

}  // namespace prism::commands
