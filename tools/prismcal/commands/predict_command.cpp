// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "compensation/extrapolation.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/commands/recording_options.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"

namespace prism::commands {
namespace {

struct PredictChoice {
  std::string model, file, out, policy = "preset";
  tables::TableOptions table;
  bool json = false, quiet = false;
};

/// With the decimal sign of the table.
std::string number(double value, const recordings::CsvColumns& columns) {
  std::string text = std::isfinite(value) ? fmt::format("{}", value) : "";
  const std::size_t point = text.find('.');
  if (point != std::string::npos) text[point] = columns.decimal;
  return text;
}

Result<int> run(const PredictChoice& choice) {
  const auto model = load_model(choice.model);
  if (!model) return tl::unexpected<Error>(model.error());
  tables::TableOptions options = choice.table;
  if (choice.quiet) options.silence();
  const auto columns = recordings::read_csv_columns(choice.file, (*model)->info().inputs, options, true);
  if (!columns) return tl::unexpected<Error>(columns.error());
  const auto& names = compensation::kExtrapolationNames;
  const auto policy =
      static_cast<compensation::Extrapolation>(std::find(names.begin(), names.end(), choice.policy) - names.begin());
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

void add_predict_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("predict", "apply a model to the rows of a CSV table");
  const auto choice = std::make_shared<PredictChoice>();
  command->add_option("model", choice->model, "model file")->required();
  command->add_option("table", choice->file, "table with columns named as the inputs of the model")->required();
  command->add_option("--out", choice->out, "CSV to write: the table's columns, prediction and sd")->required();
  command->add_option("--extrapolation", choice->policy, "preset, flag, clamp or shrink")
      ->check(CLI::IsMember(
          std::vector<std::string>(compensation::kExtrapolationNames.begin(), compensation::kExtrapolationNames.end())))
      ->capture_default_str();
  add_table_options(*command, choice->table);
  command->add_flag("--json", choice->json, "print JSON");
  command->add_flag("--quiet", choice->quiet, "no remarks on stderr");
  tools::add_examples(*command, {"prismcal predict model.json table.csv --out predicted.csv"});
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
