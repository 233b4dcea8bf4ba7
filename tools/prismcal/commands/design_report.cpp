// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/design_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include "compensation/features.hpp"
#include "config/version.hpp"

namespace prism::commands {
namespace {

std::string profile_meaning(const design::Plan& plan) {
  double soaks = 0, soaks_h = 0, from = plan.profile.start_degc;
  for (const simulation::ChamberSegment& s : plan.profile.segments) {
    if (s.end_degc == from) ++soaks, soaks_h += s.duration_s / 3600;
    from = s.end_degc;
  }
  return fmt::format("The chamber soaks {:.0f} times, {:.1f} h in all, and changes temperature in the other {:.1f} h.",
                     soaks, soaks_h, plan.profile.duration_s() / 3600 - soaks_h);
}

std::string gyro_meaning(const design::Plan& plan) {
  return fmt::format("The gyro goes from {:.1f} to {:.1f} °C; the domain has temperatures from {:.1f} to {:.1f} °C.",
                     plan.expected_t_degc.minCoeff(), plan.expected_t_degc.maxCoeff(), plan.domain_t_degc.minCoeff(),
                     plan.domain_t_degc.maxCoeff());
}

std::string worth_meaning(const design::Plan& plan) {
  const auto& others = plan.others;
  const auto best = std::min_element(others.begin(), others.end(), [](const design::Worth& a, const design::Worth& b) {
    return a.sd_deg_per_h < b.sd_deg_per_h;
  });
  std::string text = fmt::format("The designed profile takes {:.0f} % of the sd away",
                                 100 * (1 - plan.after_deg_per_h / plan.before_deg_per_h));
  if (best != others.end())
    text += fmt::format("; the best other, {}, {:.0f} % in {:.1f} h", best->name,
                        100 * (1 - best->sd_deg_per_h / plan.before_deg_per_h), best->hours);
  return text + ".";
}

std::string sd_meaning(const design::Plan& plan) {
  Eigen::Index worst = 0;
  const double sd = plan.sd_after.maxCoeff(&worst);
  return fmt::format("After the recording the model knows least at {:.1f} °C: {:.5f} deg/h, {:.5f} before.",
                     plan.domain_t_degc[worst], sd, plan.sd_before[worst]);
}

report::Table profile_table(const design::Plan& plan) {
  report::Table table{
      "profile", "The designed profile", "The chamber goes from one set-point to the next in a straight line.", {}, {}};
  table.columns = {{"from", "h"}, {"to", "h"}, {"set-point", "degC"}, {"rate", "degC/min"}, {"what", "", false}};
  double time_h = 0, from = plan.profile.start_degc;
  for (const simulation::ChamberSegment& s : plan.profile.segments) {
    const double rate = (s.end_degc - from) / (s.duration_s / 60);
    table.rows.push_back({report::fixed_cell(time_h, 2), report::fixed_cell(time_h + s.duration_s / 3600, 2),
                          report::fixed_cell(s.end_degc, 0), report::fixed_cell(rate, 2),
                          report::text_cell(rate == 0  ? "soak"
                                            : rate > 0 ? "heating"
                                                       : "cooling")});
    time_h += s.duration_s / 3600;
    from = s.end_degc;
  }
  table.meaning = profile_meaning(plan);
  return table;
}

report::Table worth_table(const design::Plan& plan) {
  report::Table table{"worth",
                      "What a recording is worth",
                      "Root mean square over the domain of the sd that the model states for another run.",
                      {{"recording", "", false}, {"length", "h"}, {"sd after", "deg/h"}},
                      {}};
  const auto add = [&](const std::string& name, std::optional<double> hours, double sd, report::Emphasis emphasis) {
    table.rows.push_back(
        {report::text_cell(name, emphasis), report::fixed_cell(hours, 1), report::fixed_cell(sd, 5, emphasis)});
  };
  add("none: spread of the bias", std::nullopt, plan.spread_deg_per_h, report::Emphasis::kNone);
  for (const design::Worth& made : plan.made) add(made.name, made.hours, made.sd_deg_per_h, report::Emphasis::kNone);
  const double hours = plan.profile.duration_s() / 3600;
  const std::string next = plan.made.empty() ? "first" : "next";
  add(next + ": designed", hours, plan.after_deg_per_h, report::Emphasis::kBest);
  if (plan.repeated_deg_per_h > 0)
    add(next + ": like the last", plan.made.back().hours, plan.repeated_deg_per_h, report::Emphasis::kNone);
  for (const design::Worth& other : plan.others)
    add(next + ": " + other.name, other.hours, other.sd_deg_per_h, report::Emphasis::kNone);
  table.meaning = worth_meaning(plan);
  return table;
}

report::Figure profile_figure(const design::Plan& plan, const design::PlanSettings& settings) {
  report::Series chamber{"chamber", report::Ink::kGuide}, gyro{"gyro, expected", report::Ink::kModel};
  chamber.x.push_back(0);
  chamber.y.push_back(plan.profile.start_degc);
  for (const simulation::ChamberSegment& s : plan.profile.segments) {
    chamber.x.push_back(chamber.x.back() + s.duration_s / 3600);
    chamber.y.push_back(s.end_degc);
  }
  gyro.x.assign(plan.expected.time_h.begin(), plan.expected.time_h.end());
  gyro.y.assign(plan.expected_t_degc.begin(), plan.expected_t_degc.end());
  return {"profile_figure",
          "The designed profile",
          fmt::format("The gyro follows with {:.0f} min, {:g} degC warmer (assumed).", settings.response.lag_s / 60,
                      settings.response.self_heating_degc),
          {1, 260, {{"", {"time, h"}, {"temperature, degC"}, {}, {chamber, gyro}}}},
          gyro_meaning(plan)};
}

report::Figure sd_figure(const design::Plan& plan) {
  std::vector<std::size_t> order(static_cast<std::size_t>(plan.domain_t_degc.size()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return plan.domain_t_degc[static_cast<Eigen::Index>(a)] < plan.domain_t_degc[static_cast<Eigen::Index>(b)];
  });
  report::Series before{"before", report::Ink::kRaw, report::SeriesStyle::kPoints},
      after{"after", report::Ink::kCorrected, report::SeriesStyle::kOpenPoints};
  for (const std::size_t i : order) {
    const auto at = static_cast<Eigen::Index>(i);
    before.x.push_back(plan.domain_t_degc[at]);
    before.y.push_back(plan.sd_before[at]);
    after.x.push_back(plan.domain_t_degc[at]);
    after.y.push_back(plan.sd_after[at]);
  }
  return {"sd_figure",
          "The expected sd over the domain",
          "Points of the domain; other inputs differ between points of equal T.",
          {1, 260, {{"", {"T, degC"}, {"sd, deg/h"}, {}, {before, after}}}},
          sd_meaning(plan)};
}

}  // namespace

report::Report design_report(const design::Plan& plan, const design::PlanSettings& settings, const std::string& basis) {
  report::Report report;
  report.title = "The next recording";
  report.subtitle = fmt::format("Designed profile of {:.1f} h: expected sd {:.5f} deg/h, now {:.5f} deg/h",
                                plan.profile.duration_s() / 3600, plan.after_deg_per_h, plan.before_deg_per_h);
  report.tool = fmt::format("prismcal {}", kVersion);
  report.facts = {{"basis", basis},
                  {"chamber", fmt::format("{:g} to {:g} degC, {:g} degC/min, starts at {:g} degC",
                                          settings.chamber.low_degc, settings.chamber.high_degc,
                                          settings.chamber.rate_degc_per_min, settings.chamber.start_degc)},
                  {"assumed", plan.assumed},
                  {"profiles tried", fmt::format("{}", plan.evaluations)}};
  report.sections = {{"design", "The designed profile", {profile_table(plan), profile_figure(plan, settings)}},
                     {"worth", "What a recording is worth", {worth_table(plan), sd_figure(plan)}}};
  return report;
}

}  // namespace prism::commands
