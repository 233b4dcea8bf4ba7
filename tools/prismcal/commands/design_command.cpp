// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/common_options.hpp"
#include "tools/prismcal/commands/design_report.hpp"
#include "tools/prismcal/commands/population_models.hpp"
#include "tools/prismcal/commands/recording_options.hpp"
#include "tools/prismcal/design/stated_prior.hpp"
#include "tools/prismcal/recordings/training_set.hpp"
#include "tools/prismcal/report/text_output.hpp"

namespace prism::commands {
namespace {

struct DesignChoice {
  std::string model, prior, domain, chamber, out;
  std::vector<std::string> mission, made;
  recordings::SourceOptions source;
  double hours = 8, start_degc = 25, lag_min = 65, self_heating_degc = 4;
  double bias_sd_deg_per_h = 0, noise_deg_per_h = 0;
  CommonOptions report;
};

// An option that takes several recordings also takes a model that follows it.
std::optional<Error> misplaced_model(const DesignChoice& choice) {
  if (!choice.model.empty()) return std::nullopt;
  const std::pair<const char*, const std::vector<std::string>*> options[] = {{"--mission", &choice.mission},
                                                                             {"--recordings", &choice.made}};
  for (const auto& [option, paths] : options) {
    for (const std::string& path : *paths) {
      if (load_model(path))
        return Error{option, fmt::format("{} is a model, expected recordings; put the model first: prismcal design {} "
                                         "{} RECORDING",
                                         path, path, option)};
    }
  }
  return std::nullopt;
}

/// The rows of recordings, each on its own.
Result<std::vector<design::RecordedInputs>> recorded(const std::vector<std::string>& paths,
                                                     const design::KnownGyro& gyro, const DesignChoice& choice) {
  if (paths.empty()) return std::vector<design::RecordedInputs>();
  recordings::TrainingSetOptions options;
  options.source = choice.source;
  if (choice.report.quiet) options.source.table.announce = {};
  options.features = gyro.features;
  options.site.no_earth_rate = true;  // the bias does not matter
  const auto set = recordings::read_training_set(paths, gyro.inputs, options);
  if (!set) return tl::unexpected<Error>(set.error());
  std::vector<design::RecordedInputs> all;
  for (const auto& rows : training::fold_members(set->data.runs))
    all.push_back({set->data.inputs(Eigen::all, rows), set->data.time_s(rows) / 3600, {}});
  return all;
}

struct Basis {
  std::vector<design::KnownGyro> gyros;
  std::string text;
};

/// The model, else models of the type, else the stated prior.
Result<Basis> basis_of(const DesignChoice& choice, const std::vector<design::InputRange>& domain) {
  std::vector<compensation::ModelPtr> models;
  if (!choice.model.empty()) {
    auto model = load_model(choice.model);
    if (!model) return tl::unexpected<Error>(model.error());
    models.push_back(std::move(*model));
  } else if (!choice.prior.empty()) {
    auto family = read_population_models(choice.prior, "");
    if (!family) return tl::unexpected<Error>(family.error());
    models = std::move(*family);
  } else {
    if (!(choice.bias_sd_deg_per_h > 0) || !(choice.noise_deg_per_h > 0))
      return make_error("design", "found no model and no --prior; expected one of them, or --bias-sd and --noise");
    if (domain.empty()) return make_error("--domain", "found none, expected one if there is no model");
    return Basis{{design::stated_gyro(domain, choice.bias_sd_deg_per_h, choice.noise_deg_per_h)},
                 fmt::format("stated prior: bias {:g} deg/h, noise {:g} deg/h", choice.bias_sd_deg_per_h,
                             choice.noise_deg_per_h)};
  }
  Basis basis;
  for (const compensation::ModelPtr& model : models) {
    auto gyro = design::known_gyro(model);
    if (!gyro) return tl::unexpected<Error>(gyro.error());
    basis.gyros.push_back(std::move(*gyro));
  }
  const std::string name = models.front()->info().name;
  basis.text = choice.model.empty() ? fmt::format("{} models of the type in {}", models.size(), choice.prior)
                                    : fmt::format("model {}, {:.12}", name, models.front()->info().id);
  return basis;
}

std::string first_line(const design::Plan& plan, const std::string& out) {
  const std::string others = fmt::format("{} takes {:.1f} h for {:.5f}", plan.others.front().name,
                                         plan.others.front().hours, plan.others.front().sd_deg_per_h);
  return fmt::format("{}: {:.1f} h; expected sd {:.5f} deg/h, now {:.5f}; {}", out, plan.profile.duration_s() / 3600,
                     plan.after_deg_per_h, plan.before_deg_per_h, others);
}

Result<int> run(const DesignChoice& choice) {
  if (auto error = misplaced_model(choice)) return tl::unexpected<Error>(std::move(*error));
  design::PlanSettings settings;
  auto chamber = design::parse_chamber(choice.chamber, choice.start_degc);
  if (!chamber) return tl::unexpected<Error>(chamber.error());
  settings.chamber = *chamber;
  settings.hours = choice.hours;
  settings.response = {choice.lag_min * 60, choice.self_heating_degc};
  if (choice.domain.empty() == choice.mission.empty())
    return make_error("design", "expected --domain or --mission, one of them");
  if (!choice.domain.empty()) {
    auto domain = design::parse_domain(choice.domain);
    if (!domain) return tl::unexpected<Error>(domain.error());
    settings.domain = std::move(*domain);
  }
  const auto basis = basis_of(choice, settings.domain);
  if (!basis) return tl::unexpected<Error>(basis.error());
  auto made = recorded(choice.made, basis->gyros.front(), choice);
  if (!made) return tl::unexpected<Error>(made.error());
  settings.made = std::move(*made);
  auto mission = recorded(choice.mission, basis->gyros.front(), choice);
  if (!mission) return tl::unexpected<Error>(mission.error());
  settings.mission = design::mission_points(*mission);
  const auto plan = design::plan_recording(basis->gyros, settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (auto done = write_text_file(choice.out, design::set_points_csv(plan->profile)); !done)
    return tl::unexpected<Error>(done.error());
  const report::Report report = design_report(*plan, settings, basis->text);
  if (!choice.report.json) {
    fmt::print("{}\n", printable(first_line(*plan, choice.out)));
    for (const report::Section& section : report.sections) {
      for (const report::Block& block : section.blocks) {
        if (const auto* table = std::get_if<report::Table>(&block)) fmt::print("{}\n", report::plain_text(*table));
      }
    }
    fmt::print("{}\n", plan->assumed);
  }
  if (auto done = write_report(report, choice.report); !done) return tl::unexpected<Error>(done.error());
  return 0;
}

}  // namespace

void add_design_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("design", "plan the next recording: the chamber profile that a model needs most");
  const auto choice = std::make_shared<DesignChoice>();
  command->add_option("model", choice->model,
                      "composite model of the gyro (default: --prior, or --bias-sd and --noise)");
  command->add_option("--domain", choice->domain,
                      "inputs that the model must serve: \"T=-40:60, dTdt=-1:1 degC/min\"; slopes need their unit");
  command->add_option("--mission", choice->mission, "recordings of the use, instead of --domain");
  command->add_option("--chamber", choice->chamber,
                      "limits: \"rate<=2 degC/min, T=-45:65\" (default: 1 degC/min, -40 to 70 degC)");
  command->add_option("--hours", choice->hours, "length of the recording, h")
      ->check(tools::within(0.5, 200))
      ->capture_default_str();
  command->add_option("--out", choice->out, "CSV of set-points to write: time_s,temperature_degc")->required();
  command->add_option("--recordings", choice->made, "recordings already made that the model was not trained on");
  command->add_option("--prior", choice->prior,
                      "without a model: folder with two or more models of gyros of the same type");
  command->add_option("--bias-sd", choice->bias_sd_deg_per_h, "without both: spread of the bias over the domain, deg/h")
      ->check(tools::positive());
  command->add_option("--noise", choice->noise_deg_per_h, "with --bias-sd: noise of the mean rate of 100 s, deg/h")
      ->check(tools::positive());
  command->add_option("--start", choice->start_degc, "temperature of the chamber at the start, degC")
      ->check(tools::within(-200, 300))
      ->capture_default_str();
  command->add_option("--thermal-lag", choice->lag_min, "time constant of the gyro behind the chamber, min; 0: none")
      ->check(tools::within(0, 1000))
      ->capture_default_str();
  command->add_option("--self-heating", choice->self_heating_degc, "gyro minus chamber after a long soak, degC")
      ->check(tools::within(-100, 100))
      ->capture_default_str();
  command->add_option("--report", choice->report.out,
                      "folder for report.html with the figures, report.csv, report.json");
  add_source_options(*command, choice->source);
  accept_site_options(*command);  // the bias does not matter
  command->add_flag("--json", choice->report.json, "print the report as JSON");
  command->add_flag("--quiet", choice->report.quiet, "no remarks on stderr");
  tools::add_examples(
      *command, {"prismcal design model.json --domain \"T=-40:60, dTdt=-1:1 degC/min\" --chamber \"rate<=2 degC/min, "
                 "T=-45:65\" --out "
                 "cycle.csv",
                 "prismcal design model.json --mission flights/ --hours 12 --out cycle.csv --report plan",
                 "prismcal design --prior models/ --domain \"T=-30:60, dTdt=-0.5:0.5 degC/min\" --out cycle.csv"});
  command->callback([choice, &code] {
    const auto done = run(*choice);
    code = done ? *done : failed(done.error());
  });
}

}  // namespace prism::commands
