// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/train_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>

#include "compensation/model_text.hpp"
#include "compensation/text_number.hpp"
#include "config/text_file.hpp"
#include "config/version.hpp"
#include "tools/prismcal/analysis/gate_table.hpp"
#include "tools/prismcal/commands/interrupt.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/recordings/csv_table.hpp"
#include "tools/prismcal/recordings/recordings.hpp"
#include "tools/prismcal/report/plain_text.hpp"

namespace prism::commands {
namespace {

struct Choice {
  std::vector<std::string> files;
  std::string inputs = "T,dTdt,U", out, serial, name;
  recordings::RecordingOptions recordings;
  MethodOptions method;
  bool force = false;
};

// The quality gate over every recording, before a model is made: its answers go into the facts, and onto the terminal
// where a recording does not simply pass.
Result<void> ask_gate(recordings::RecordingSet& set, const Choice& choice) {
  std::optional<Error> refused;
  for (std::size_t i = 0; i < set.tables.size(); ++i) {
    const recordings::BlockTable& table = set.tables[i];
    const auto gate = analysis::judge_blocks(table);
    if (!gate) return tl::unexpected<Error>(gate.error());
    set.facts[i]["quality_gate"] = analysis::gate_json(*gate);
    if (gate->verdict != evaluation::Verdict::kPass && !choice.method.quiet)
      fmt::print(stderr, "{}\n", report::plain_text(analysis::gate_table(*gate, table.name)));
    if (gate->verdict == evaluation::Verdict::kRefuse || gate->nothing_to_compensate)
      refused = Error{choice.files[i], analysis::gate_paragraph(*gate, table.name).text};
  }
  if (refused && !choice.force) return refuse(refused->where, refused->what + " --force trains all the same");
  return {};
}

// LS: a cubic of the only input (eq. 21). Stepwise: all terms of second order (eqs. 22, 24), begun with T, T² and
// dT/dt.
Result<void> set_terms(const Choice& choice, const std::vector<std::string>& names,
                       training::TrainingSettings& settings) {
  if (settings.method == training::Method::kLeastSquares) {
    if (names.size() != 1)
      return refuse("--inputs",
                    fmt::format("found {} with --method ls, expected one: it is a cubic of one input", names.size()));
    settings.terms = training::cubic_terms();
  }
  if (settings.method != training::Method::kStepwise) return {};
  settings.terms = training::second_order_terms(names.size());
  const std::vector<std::string> start = choice.method.start.empty()     ? std::vector<std::string>{"T", "T^2", "dTdt"}
                                         : choice.method.start == "none" ? std::vector<std::string>{}
                                                                         : recordings::split_names(choice.method.start);
  for (const std::string& wanted : start) {
    bool found = false;
    for (std::size_t i = 0; i < settings.terms.size(); ++i) {
      if (training::term_name(settings.terms[i], names) != wanted) continue;
      settings.stepwise.start.push_back(static_cast<int>(i));
      found = true;
    }
    if (!found && !choice.method.start.empty())
      return refuse("--start", fmt::format("found \"{}\", expected terms such as T, T^2 or T*dTdt", wanted));
  }
  return {};
}

std::string provenance(const recordings::RecordingSet& set, const nlohmann::ordered_json& summary) {
  nlohmann::ordered_json json = {{"tool", fmt::format("prismcal {}", kVersion)},
                                 {"made", utc_text(std::time(nullptr))}};
  json["recordings"] = set.facts;
  json["training"] = summary;
  json["training"].erase("id");
  if (json["training"].contains("tuning")) json["training"]["tuning"].erase("surface");
  return json.dump();
}

Result<int> run(const Choice& choice) {
  auto settings = settings_of(choice.method);
  if (!settings) return tl::unexpected<Error>(settings.error());
  const std::vector<std::string> names = recordings::split_names(choice.inputs);
  if (auto good = set_terms(choice, names, *settings); !good) return tl::unexpected<Error>(good.error());
  auto set = recordings::read_recordings(choice.files, names, choice.recordings);
  if (!set) return tl::unexpected<Error>(set.error());
  if (!choice.method.quiet) {
    for (const std::string& note : set->notes) fmt::print(stderr, "{}\n", note);
  }
  if (auto fit = ask_gate(*set, choice); !fit) return tl::unexpected<Error>(fit.error());
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
  const auto choice = std::make_shared<Choice>();
  command->add_option("recordings", choice->files, "prismd's logs (files or folders), captures, or CSV with --map")
      ->required();
  command->add_option("--inputs", choice->inputs, "T, dTdt, U, lag1, lag2, …")->capture_default_str();
  command->add_option("--out", choice->out, "model file to write")->required();
  command->add_option("--serial", choice->serial, "of the gyro (default: what the recordings say)");
  command->add_option("--name", choice->name, "of the model, for people");
  command->add_flag("--force", choice->force, "train although the quality gate refuses a recording");
  recordings::add_recording_options(*command, choice->recordings);
  add_method_options(*command, choice->method);
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
