// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/outside_text.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/training_run.hpp"

namespace prism::commands {
namespace {

std::string held_out_text(const nlohmann::ordered_json& held_out) {
  std::string text;
  for (const auto& part : held_out) {
    const auto number = [&](const char* key) { return part[key].get<double>(); };
    const std::string gain = part["improvement_percent"].is_null()
                                 ? "improvement undefined"
                                 : fmt::format("improvement {:.1f} %", number("improvement_percent"));
    text += fmt::format(
        "held out, {} of {}: {} blocks, raw {:.4g}, corrected {:.4g} deg/h (1 sigma, divisor N-1), {}; {:.1f} % "
        "outside "
        "the training range\n",
        part["part"].get<std::string>(), part["recording"].get<std::string>(), part["blocks"].get<std::size_t>(),
        number("raw_deg_per_h"), number("corrected_deg_per_h"), gain, number("extrapolated_percent"));
  }
  return text +
         "  The held-out part shares its switch-on with the rest: another recording is a stronger test.\n  This model "
         "was "
         "trained without that part; for prismd, train again without --hold-out.\n";
}

/// The test on another recording, which is read like these.
std::string next_command(const TrainChoice& choice) {
  const recordings::SourceOptions& source = choice.recordings.source;
  std::string text = "prismcal evaluate " + choice.out + " ANOTHER-RECORDING";
  if (!source.map.empty()) text += " --map …";
  if (!source.config.empty()) text += " --config " + source.config;
  if (!source.axis.empty()) text += " --axis " + source.axis;
  if (choice.recordings.site.no_earth_rate) text += " --no-earth-rate";
  return text + " --out report";
}

/// Trains and writes one model; returns the JSON of --json, or prints the text.
Result<nlohmann::ordered_json> run_one(const TrainChoice& choice) {
  for (const auto& [option, text] : {std::pair{"--name", &choice.name}, {"--serial", &choice.serial}}) {
    if (auto good = check_text(TextRule::kText, *text, option); !good) return tl::unexpected<Error>(good.error());
  }
  auto run = train_on_recordings(choice, stop_on_interrupt);
  if (!run) return tl::unexpected<Error>(run.error());
  if (auto done = write_text_file(choice.out, run->model_text()); !done) return tl::unexpected<Error>(done.error());
  if (!choice.method.json) {
    fmt::print("{}",
               printable_lines(first_sentence(run->judgement, run->expected, run->quality, next_command(choice))));
    fmt::print("{}", summary_text(run->trained, run->settings, run->set.data.names));
    if (run->summary.contains("held_out")) fmt::print("{}", held_out_text(run->summary["held_out"]));
  }
  return std::move(run->summary);
}

// "model.json" → "model-x.json"
std::string path_of_axis(const std::string& out, const std::string& axis) {
  const std::filesystem::path path(out);
  return (path.parent_path() / (path.stem().string() + "-" + axis + path.extension().string())).string();
}

/// Trains one model per axis; reports an axis that cannot be trained and continues with the others.
int run_all(const TrainChoice& choice, const std::vector<std::string>& axes) {
  nlohmann::ordered_json json;
  int code = 0;
  for (const std::string& axis : axes) {
    TrainChoice own = choice;
    own.recordings.source.axis = axis;
    own.out = path_of_axis(choice.out, axis);
    if (!own.name.empty()) own.name += " " + axis;
    if (!choice.method.json) fmt::print("{}axis {}: {}\n", axis == axes.front() ? "" : "\n", axis, own.out);
    std::fflush(stdout);
    const auto done = run_one(own);
    if (done) {
      json[axis] = *done;
    } else {
      json[axis] = {{"refused", done.error().text()}};
      code = failed(Error{"axis " + axis, done.error().text()});
    }
  }
  if (choice.method.json) fmt::print("{}\n", json_text(json, 2));
  return code;
}

Result<int> run(const TrainChoice& choice) {
  if (!choice.from.empty()) {
    const auto done = train_from(choice);
    if (!done) return tl::unexpected<Error>(done.error());
    if (choice.method.json) fmt::print("{}\n", done->dump(2));
    return 0;
  }
  if (choice.recordings.source.axis.empty()) {
    const auto axes = recordings::axes_of(choice.files.front(), choice.recordings.source);
    if (!axes) return tl::unexpected<Error>(axes.error());
    if (axes->size() > 1) return run_all(choice, *axes);
  }
  const auto done = run_one(choice);
  if (!done) return tl::unexpected<Error>(done.error());
  if (choice.method.json) fmt::print("{}\n", done->dump(2));
  return 0;
}

}  // namespace

void add_train_command(CLI::App& app, int& code) {
  CLI::App* command = app.add_subcommand("train", "train a model for prismd on recordings");
  const auto choice = std::make_shared<TrainChoice>();
  add_options(*command,
              {{"recordings", &choice->files, kRecordings},
               {"--out", &choice->out, "model file to write; NAME-AXIS.json for each of several axes"}},
              Need::kRequired);
  add_train_options(*command, *choice);
  CLI::Option* from = command->add_option(
      "--from", choice->from, "keep the shape of this model; only its constant is determined again, from time at rest");
  // The model determines everything else.
  const std::set<std::string> with_from = {"recordings", "--out",       "--from",     "--name",      "--force",
                                           "--map",      "--interval",  "--decimal",  "--time-unit", "--config",
                                           "--axis",     "--leave-out", "--latitude", "--elevation", "--azimuth",
                                           "--json",     "--quiet"};
  for (CLI::Option* option : command->get_options()) {
    if (option != command->get_help_ptr() && !with_from.contains(option->get_name())) from->excludes(option);
  }
  constexpr const char* kMapped =
      "prismcal train chamber.csv --map rate=rate_x:deg/s,temperature=temp:degC,time=t:s "
      "--latitude 48.1 --elevation 90 --inputs T,dTdt --out model.json";
  tools::add_examples(*command,
                      {"prismcal train logs/ --inputs T,dTdt,U --out model.json",
                       "prismcal train cycle1.pcap cycle2.pcap --config gyro.json --method stepwise --out model.json",
                       kMapped, "prismcal train logs/ --hold-out blocks:600 --out model.json",
                       "prismcal train four-hours.csv --prior models/ --out model.json",
                       "prismcal train --from model.json logs/ --out moved.json"});
  command->callback([choice, &code] { code = exit_code(run(*choice)); });
}

}  // namespace prism::commands
