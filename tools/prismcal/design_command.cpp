// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "config/version.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/option_table.hpp"
#include "tools/prismcal/plan.hpp"

namespace prism::commands {
namespace {

struct DesignChoice {
  std::string model, prior, domain, chamber, out;
  double hours = 8, start_degc = 25, lag_min = 65, self_heating_degc = 4;
  double bias_sd_deg_per_h = 0, noise_deg_per_h = 0;
  CommonOptions report;
};

struct Basis {
  std::vector<design::KnownGyro> gyros;
  std::string text;
};

/// The model, else models of the type, else the stated prior.
Result<Basis> basis_of(const DesignChoice& choice, const std::vector<design::InputRange>& domain) {
  Basis basis;
  std::vector<compensation::ModelPtr> models;
  if (!choice.model.empty()) {
    auto model = load_model(choice.model);
    if (!model) return tl::unexpected<Error>(model.error());
    basis.text = fmt::format("model {}, {:.12}", (*model)->info().name, (*model)->info().id);
    models = {std::move(*model)};
  } else if (!choice.prior.empty()) {
    auto family = read_population_models(choice.prior, "");
    if (!family) return tl::unexpected<Error>(family.error());
    models = std::move(*family);
    basis.text = fmt::format("{} models of the type in {}", models.size(), choice.prior);
  } else if (choice.bias_sd_deg_per_h > 0 && choice.noise_deg_per_h > 0) {
    basis.gyros = {design::stated_gyro(domain, choice.bias_sd_deg_per_h, choice.noise_deg_per_h)};
    basis.text = fmt::format("stated prior: bias {:g} deg/h, noise {:g} deg/h", choice.bias_sd_deg_per_h,
                             choice.noise_deg_per_h);
  } else {
    return make_error("design", "found no model and no --prior; expected one of them, or --bias-sd and --noise");
  }
  for (const compensation::ModelPtr& model : models) {
    auto gyro = design::known_gyro(model);
    if (!gyro) return tl::unexpected<Error>(gyro.error());
    basis.gyros.push_back(std::move(*gyro));
  }
  return basis;
}

// The report.

report::Table profile_table(const design::Plan& plan) {
  report::Table table{"profile", "The designed profile",
                      "The chamber goes from one set-point to the next in a straight line.",
                      report::columns("from [h] | to [h] | set-point [degC] | rate [degC/min] | what:")};
  double time_h = 0, from = plan.profile.start_degc, soaks_h = 0;
  int soaks = 0;
  for (const simulation::ChamberSegment& s : plan.profile.segments) {
    const double rate = (s.end_degc - from) / (s.duration_s / 60), hours = s.duration_s / 3600;
    table.rows.push_back({report::fixed_cell(time_h, 2), report::fixed_cell(time_h + hours, 2),
                          report::fixed_cell(s.end_degc, 0), report::fixed_cell(rate, 2),
                          rate == 0  ? "soak"
                          : rate > 0 ? "heating"
                                     : "cooling"});
    if (rate == 0) ++soaks, soaks_h += hours;
    time_h += hours;
    from = s.end_degc;
  }
  table.meaning =
      fmt::format("The chamber soaks {} times, {:.1f} h in all, and changes temperature in the other {:.1f} h.", soaks,
                  soaks_h, plan.profile.duration_s() / 3600 - soaks_h);
  return table;
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

report::Figure profile_figure(const design::Plan& plan, const design::PlanSettings& settings) {
  report::Series chamber{"chamber", report::Ink::kGuide, {}, {0}, {plan.profile.start_degc}},
      gyro{"gyro, expected", report::Ink::kModel};
  for (const simulation::ChamberSegment& s : plan.profile.segments) {
    chamber.x.push_back(chamber.x.back() + s.duration_s / 3600);
    chamber.y.push_back(s.end_degc);
  }
  gyro.x.assign(plan.expected.time_h.begin(), plan.expected.time_h.end());
  gyro.y.assign(plan.expected_t_degc.begin(), plan.expected_t_degc.end());
  const auto t = std::ranges::find(settings.domain, compensation::kInputTemperature, &design::InputRange::input);
  return {"profile_figure",
          "The designed profile",
          fmt::format("The gyro follows with {:.0f} min, {:g} degC warmer (assumed).", settings.response.lag_s / 60,
                      settings.response.self_heating_degc),
          {1, 260, {{"", {"time, h"}, {"temperature, degC"}, {chamber, gyro}}}},
          fmt::format("The gyro goes from {:.1f} to {:.1f} °C; the domain has temperatures from {:.1f} to {:.1f} °C.",
                      plan.expected_t_degc.minCoeff(), plan.expected_t_degc.maxCoeff(), t->low, t->high)};
}

Result<int> run(const DesignChoice& choice) {
  design::PlanSettings settings;
  auto chamber = design::parse_chamber(choice.chamber, choice.start_degc);
  if (!chamber) return tl::unexpected<Error>(chamber.error());
  settings.chamber = *chamber;
  settings.hours = choice.hours;
  settings.response = {choice.lag_min * 60, choice.self_heating_degc};
  auto domain = design::parse_domain(choice.domain);
  if (!domain) return tl::unexpected<Error>(domain.error());
  settings.domain = std::move(*domain);
  const auto basis = basis_of(choice, settings.domain);
  if (!basis) return tl::unexpected<Error>(basis.error());
  const auto plan = design::plan_recording(basis->gyros, settings);
  if (!plan) return tl::unexpected<Error>(plan.error());
  if (auto done = write_text_file(choice.out, design::set_points_csv(plan->profile)); !done)
    return tl::unexpected<Error>(done.error());
  const double hours = plan->profile.duration_s() / 3600, before = plan->before_deg_per_h(),
               after = plan->after_deg_per_h;
  report::Report report;
  report.title = "The next recording";
  report.subtitle =
      fmt::format("Designed profile of {:.1f} h: expected sd {:.5f} deg/h, now {:.5f} deg/h", hours, after, before);
  report.tool = fmt::format("prismcal {}", kVersion);
  report.facts = {{"basis", basis->text},
                  {"chamber", fmt::format("{:g} to {:g} degC, {:g} degC/min, starts at {:g} degC", chamber->low_degc,
                                          chamber->high_degc, chamber->rate_degc_per_min, chamber->start_degc)},
                  {"assumed", plan->assumed},
                  {"profiles tried", fmt::format("{}", plan->evaluations)}};
  report.sections = {{"design", "The designed profile", {profile_table(*plan), profile_figure(*plan, settings)}},
                     {"worth", "What a recording is worth", {worth_table(*plan)}}};
  if (!choice.report.json) {
    const design::Worth& paper = plan->others.front();
    fmt::print("{}: {:.1f} h; expected sd {:.5f} deg/h, now {:.5f}; {} takes {:.1f} h for {:.5f}\n{}\n{}\n",
               printable(choice.out), hours, after, before, paper.name, paper.hours, paper.sd_deg_per_h,
               report::plain_text(report), plan->assumed);
  }
  return write_report(report, choice.report).map([] { return 0; });
}

}  // namespace

void add_design_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("design", "plan the next recording: the chamber profile that a model needs most");
  const auto choice = std::make_shared<DesignChoice>();
  add_options(*command,
              {{"--out", &choice->out, "CSV of set-points to write: time_s,temperature_degc"},
               {"--domain", &choice->domain,
                "inputs that the model must serve: \"T=-40:60, dTdt=-1:1 degC/min\"; slopes need their unit"}},
              Need::kRequired);
  add_options(
      *command,
      {{"model", &choice->model, "composite model of the gyro (default: --prior, or --bias-sd and --noise)"},
       {"--chamber", &choice->chamber, "limits: \"rate<=2 degC/min, T=-45:65\" (default: 1 degC/min, -40 to 70 degC)"},
       {"--hours", &choice->hours, "length of the recording, h", tools::within(0.5, 200)},
       {"--prior", &choice->prior, "without a model: folder with two or more models of gyros of the same type"},
       {"--bias-sd", &choice->bias_sd_deg_per_h, "without both: spread of the bias over the domain, deg/h",
        tools::positive()},
       {"--noise", &choice->noise_deg_per_h, "with --bias-sd: noise of the mean rate of 100 s, deg/h",
        tools::positive()},
       {"--start", &choice->start_degc, "temperature of the chamber at the start, degC", tools::within(-200, 300)},
       {"--thermal-lag", &choice->lag_min, "time constant of the gyro behind the chamber, min; 0: none",
        tools::within(0, 1000)},
       {"--self-heating", &choice->self_heating_degc, "gyro minus chamber after a long soak, degC",
        tools::within(-100, 100)},
       {"--report", &choice->report.out, "folder for report.html with the figures, report.csv, report.json"},
       {"--json", &choice->report.json, "print the report as JSON"},
       {"--quiet", &choice->report.quiet, "no remarks on stderr"}});
  refuse_removed(*command, "--mission", "state the ranges of its inputs by --domain");
  refuse_removed(*command, "--recordings", "train the model on them, too");
  tools::add_examples(
      *command, {"prismcal design model.json --domain \"T=-40:60, dTdt=-1:1 degC/min\" --chamber \"rate<=2 degC/min, "
                 "T=-45:65\" --out "
                 "cycle.csv",
                 "prismcal design --prior models/ --domain \"T=-30:60, dTdt=-0.5:0.5 degC/min\" --out cycle.csv"});
  command->callback([choice, &code] { code = exit_code(run(*choice)); });
}

}  // namespace prism::commands
