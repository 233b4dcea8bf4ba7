// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>

#include "compensation/model_text.hpp"
#include "compensation/text_number.hpp"
#include "config/text_file.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/analysis/data_quality_table.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/training_set.hpp"
#include "tools/prismcal/report/text_forms.hpp"

namespace prism::commands {
namespace {

struct TrainChoice {
  std::vector<std::string> files;
  std::string inputs = "T,dTdt,U", out, serial, name;
  recordings::TrainingSetOptions recordings;
  MethodOptions method;
  bool force = false;
};

// The data-quality check over every recording, before a model is made: its answer goes into the facts, and onto the
// terminal where a recording does not simply pass.
Result<void> check_recordings(recordings::TrainingSet& set, const TrainChoice& choice) {
  std::optional<Error> refused;
  for (std::size_t i = 0; i < set.tables.size(); ++i) {
    const recordings::BlockTable& table = set.tables[i];
    const auto quality = analysis::check_blocks(table);
    if (!quality) return tl::unexpected<Error>(quality.error());
    set.facts[i]["data_quality"] = analysis::data_quality_json(*quality);
    if (quality->verdict != evaluation::Verdict::kPass && !choice.method.quiet)
      fmt::print(stderr, "{}\n", report::plain_text(analysis::data_quality_table(*quality, table.name)));
    if (quality->verdict == evaluation::Verdict::kRefuse || quality->nothing_to_compensate)
      refused = Error{choice.files[i], analysis::data_quality_paragraph(*quality, table.name).text};
  }
  if (refused && !choice.force) return refuse(refused->where, refused->what + " --force trains all the same");
  return {};
}

std::string provenance(const recordings::TrainingSet& set, const nlohmann::ordered_json& summary) {
  nlohmann::ordered_json json = {{"tool", fmt::format("prismcal {}", kVersion)},
                                 {"made", utc_text(std::time(nullptr))}};
  json["recordings"] = set.facts;
  json["training"] = provenance_json(summary);
  return json.dump();
}

Result<int> run(const TrainChoice& choice) {
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  const std::vector<std::string> names = recordings::csv_fields(choice.inputs, ',');
  if (auto good =
          set_terms(choice.method, names, training::second_order_terms(names.size()), {"T", "T^2", "dTdt"}, *settings);
      !good)
    return tl::unexpected<Error>(good.error());
  auto set = recordings::read_training_set(choice.files, names, choice.recordings);
  if (!set) return tl::unexpected<Error>(set.error());
  if (!choice.method.quiet) {
    for (const std::string& note : set->notes) fmt::print(stderr, "{}\n", note);
  }
  if (auto fit = check_recordings(*set, choice); !fit) return tl::unexpected<Error>(fit.error());
  const auto plan = training::plan_resources(set->data.inputs.cols(), set->data.inputs.rows(), *settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (!choice.method.quiet && plan->seconds > 0.5) fmt::print(stderr, "{}\n", plan->text());
  compensation::ModelInfo info;
  info.name =
      choice.name.empty() ? fmt::format("{} {}", training::method_name(settings->method), choice.inputs) : choice.name;
  info.gyro_serial = choice.serial.empty() ? set->serial : choice.serial;
  info.features = set->features;
  auto trained =
      training::train(set->data, std::move(info), *settings, progress_bar(choice.method.quiet), stop_on_interrupt());
  end_progress();
  if (!trained) return tl::unexpected<Error>(trained.error());
  auto summary = summary_json(*trained, *settings, names);
  summary["recordings"] = set->facts;
  const std::string text = compensation::format_model(*trained->model, provenance(*set, summary));
  if (auto done = config::write_text_file(choice.out, text); !done) return tl::unexpected<Error>(done.error());
  fmt::print("{}", choice.method.json ? summary.dump(2) + "\n" : summary_text(*trained, *settings, names));
  return 0;
}

}  // namespace

void add_train_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("train", "train a model on recordings, ready for prismd");
  const auto choice = std::make_shared<TrainChoice>();
  command->add_option("recordings", choice->files, "prismd's logs (files or folders), captures, or CSV with --map")
      ->required();
  command->add_option("--inputs", choice->inputs, "T, dTdt, U, lag1, lag2, …")->capture_default_str();
  command->add_option("--out", choice->out, "model file to write")->required();
  command->add_option("--serial", choice->serial, "of the gyro (default: what the recordings say)");
  command->add_option("--name", choice->name, "of the model, for people");
  command->add_flag("--force", choice->force, "train although the data-quality check refuses a recording");
  recordings::add_training_set_options(*command, choice->recordings);
  add_method_options(*command, choice->method);
  tools::add_examples(*command,
                      {"prismcal train logs/ --inputs T,dTdt,U --out model.json",
                       "prismcal train cycle1.pcap cycle2.pcap --config gyro.json --method stepwise --out model.json",
                       "prismcal train chamber.csv --map rate=rate_x:deg/s,temperature=temp:degC,time=t:s "
                       "--no-earth-rate --inputs T,dTdt --out model.json"});
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
