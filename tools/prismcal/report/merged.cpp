// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/merged.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace prism::report {
namespace {

using Fact = std::pair<std::string, std::string>;

bool in_all(const std::vector<std::pair<std::string, Report>>& axes, const Fact& fact) {
  return std::all_of(axes.begin(), axes.end(), [&](const auto& axis) {
    const std::vector<Fact>& facts = axis.second.facts;
    return std::find(facts.begin(), facts.end(), fact) != facts.end();
  });
}

/// Facts of `report` that are in all reports, or (`common` false) the others.
std::vector<Fact> facts_of(const std::vector<std::pair<std::string, Report>>& axes, const Report& report, bool common) {
  std::vector<Fact> facts;
  for (const Fact& fact : report.facts) {
    if (in_all(axes, fact) == common) facts.push_back(fact);
  }
  return facts;
}

Table own_facts_table(const std::vector<Fact>& facts) {
  Table table{"own_facts", "Sources of this axis", "", {{"what", {}, false}, {"which", {}, false}}};
  for (const auto& [name, value] : facts) table.rows.push_back({text_cell(name), text_cell(value)});
  table.meaning = fmt::format("These {} sources belong to this axis; the head of the page lists those of all axes.",
                              table.rows.size());
  return table;
}

void name_after(const std::string& axis, std::size_t number, Section& section) {
  const std::string title = "Axis " + axis + ": ";
  section.id = id_of_axis(number, section.id);
  section.heading = title + section.heading;
  for (Block& block : section.blocks) {
    if (auto* table = std::get_if<Table>(&block)) {
      table->id = id_of_axis(number, table->id);
      table->title = title + table->title;
    } else if (auto* figure = std::get_if<Figure>(&block)) {
      figure->id = id_of_axis(number, figure->id);
      figure->title = title + figure->title;
    }
  }
}

}  // namespace

std::string id_of_axis(std::size_t number, const std::string& id) { return fmt::format("axis{}_{}", number, id); }

Report merged(std::vector<std::pair<std::string, Report>> axes, Section overview) {
  Report all;
  const Report& first = axes.front().second;
  all.title = first.title, all.subtitle = first.subtitle, all.tool = first.tool, all.warning = first.warning;
  all.facts = facts_of(axes, first, true);
  all.sections.push_back(std::move(overview));
  for (auto& [axis, report] : axes) {
    const std::vector<Fact> own = facts_of(axes, report, false);
    if (!own.empty() && !report.sections.empty()) report.sections.front().blocks.emplace_back(own_facts_table(own));
  }
  std::size_t number = 0;
  for (auto& [axis, report] : axes) {
    ++number;
    all.simulated = all.simulated || report.simulated;
    for (Section& section : report.sections) name_after(axis, number, section);
    std::move(report.sections.begin(), report.sections.end(), std::back_inserter(all.sections));
  }
  return all;
}

}  // namespace prism::report
