// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/plan.hpp"

namespace prism::commands {
namespace {

struct DesignChoice {
  std::string model, prior, domain, out;
  design::PlanSettings settings;
  double lag_min = settings.response.lag_s / 60;
};

struct Basis {
  std::vector<design::KnownGyro> gyros;
  std::string text;
};

/// The model, else models of the type.
Result<Basis> basis_of(const DesignChoice& choice) {
  if (choice.model.empty() && choice.prior.empty())
    return make_error("design", "found no model and no --prior, expected one of them");
  Basis basis;
  std::vector<compensation::ModelPtr> models;
  if (!choice.model.empty()) {
    auto model = load_model(choice.model);
    if (!model) return tl::unexpected<Error>(model.error());
    basis.text = fmt::format("model {}, {:.12}", (*model)->info().name, (*model)->info().id);
    models = {std::move(*model)};
  } else {
    auto family = read_population_models(choice.prior, "");
    if (!family) return tl::unexpected<Error>(family.error());
    models = std::move(*family);
    basis.text = fmt::format("{} models of the type in {}", models.size(), choice.prior);
  }
  for (const compensation::ModelPtr& model : models) {
    auto gyro = design::known_gyro(model);
    if (!gyro) return tl::unexpected<Error>(gyro.error());
    basis.gyros.push_back(std::move(*gyro));
  }
  return basis;
}

report::Table worth_table(const design::Plan& plan) {
  report::Table table{"worth", "What a recording is worth",
                      "Root mean square over the domain of the sd that the model states for another run.",
                      report::columns("recording: | length [h] | sd after [deg/h]")};
  const auto add = [&](const std::string& name, double hours, double sd, report::Emphasis emphasis) {
    table.rows.push_back({{name, emphasis}, report::fixed_cell(hours, 1), report::fixed_cell(sd, 5, emphasis)});
  };
  using report::Emphasis;
  for (const auto& [name, hours, sd] : plan.made) add(name, hours, sd, Emphasis::kNone);
  const std::string next = plan.made.size() > 1 ? "next: " : "first: ";
  add(next + "designed", plan.profile.duration_s() / 3600, plan.after_deg_per_h, Emphasis::kBest);
  for (const auto& [name, hours, sd] : plan.others) add(next + name, hours, sd, Emphasis::kNone);
  const auto removed_percent = [&](double sd) { return 100 * (1 - sd / plan.before_deg_per_h()); };
  const design::Worth& best = *std::ranges::min_element(plan.others, {}, &design::Worth::sd_deg_per_h);
  table.meaning =
      fmt::format("The designed profile takes {:.0f} % of the sd away; the best other, {}, {:.0f} % in {:.1f} h.",
                  removed_percent(plan.after_deg_per_h), best.name, removed_percent(best.sd_deg_per_h), best.hours);
  return table;
}

Result<int> run(const DesignChoice& choice) {
  design::PlanSettings settings = choice.settings;
  const design::ChamberLimits& chamber = settings.chamber;
  if (!(chamber.low_degc < chamber.high_degc) || chamber.start_degc < chamber.low_degc ||
      chamber.start_degc > chamber.high_degc)
    return make_error("--start", fmt::format("found {} degC, expected --coldest {} or above, and --hottest {} or below",
                                             chamber.start_degc, chamber.low_degc, chamber.high_degc));
  settings.response.lag_s = choice.lag_min * 60;
  auto domain = design::parse_domain(choice.domain);
  if (!domain) return tl::unexpected<Error>(domain.error());
  settings.domain = std::move(*domain);
  const auto basis = basis_of(choice);
  if (!basis) return tl::unexpected<Error>(basis.error());
  const auto plan = design::plan_recording(basis->gyros, settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (auto done = write_text_file(choice.out, design::set_points_csv(plan->profile)); !done)
    return tl::unexpected<Error>(done.error());
  fmt::print("{}: {:.1f} h; by {}\n\n{}\nThe gyro goes from {:.1f} to {:.1f} degC. {}\n", printable(choice.out),
             plan->profile.duration_s() / 3600, printable(basis->text), report::plain_text(worth_table(*plan)),
             plan->expected_t_degc.minCoeff(), plan->expected_t_degc.maxCoeff(), plan->assumed);
  return 0;
}

}  // namespace

void add_design_command(CLI::App& app, int& code) {
  const auto [command, choice] = new_command<DesignChoice>(
      app, code, "design", "plan the next recording: the chamber profile that a model needs most", run);
  add_options(command,
              {{"--out", &choice.out, "CSV of set-points to write: time_s,temperature_degc"},
               {"--domain", &choice.domain,
                "inputs that the model must serve: \"T=-40:60, dTdt=-1:1 degC/min\"; slopes need their unit"}},
              Need::kRequired);
  design::PlanSettings& settings = choice.settings;
  add_options(
      command,
      {{"model", &choice.model, "composite model of the gyro (default: --prior)"},
       {"--coldest", &settings.chamber.low_degc, "of the chamber, degC", tools::within(-200, 300)},
       {"--hottest", &settings.chamber.high_degc, "of the chamber, degC", tools::within(-200, 300)},
       {"--rate", &settings.chamber.rate_degc_per_min, "of the chamber's ramps at most, degC/min", tools::positive()},
       {"--start", &settings.chamber.start_degc, "temperature of the chamber at the start, degC",
        tools::within(-200, 300)},
       {"--hours", &settings.hours, "length of the recording, h", tools::within(0.5, 200)},
       {"--prior", &choice.prior, "without a model: folder with two or more models of gyros of the same type"},
       {"--thermal-lag", &choice.lag_min, "time constant of the gyro behind the chamber, min; 0: none",
        tools::within(0, 1000)},
       {"--self-heating", &settings.response.self_heating_degc, "gyro minus chamber after a long soak, degC",
        tools::within(-100, 100)}});
  refuse_removed(command, "--mission", "state the ranges of its inputs by --domain");
  refuse_removed(command, "--recordings", "train the model on them, too");
  refuse_removed(command, "--chamber", "state --coldest, --hottest and --rate");
  for (const char* name : {"--bias-sd", "--noise"})
    refuse_removed(command, name, "record the paper's cycle first, or give models of the type by --prior");
  for (const char* name : {"--report", "--json", "--quiet"})
    refuse_removed(command, name, "the CSV has the profile, and the table of its value is printed");
  tools::add_examples(
      command, {"prismcal design model.json --domain \"T=-40:60, dTdt=-1:1 degC/min\" --hottest 65 --rate 2 --out "
                "cycle.csv",
                "prismcal design --prior models/ --domain \"T=-30:60, dTdt=-0.5:0.5 degC/min\" --out cycle.csv"});
}

}  // namespace prism::commands
