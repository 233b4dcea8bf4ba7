// SPDX-License-Identifier: MIT
#include "tools/prismcal/limits.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/file.hpp"
#include "base/json_document.hpp"

namespace prism::analysis {

std::string range_text(const Limit& limit) {
  if (limit.min && limit.max) return fmt::format("{:g} to {:g}", *limit.min, *limit.max);
  return limit.min ? fmt::format("at least {:g}", *limit.min) : fmt::format("at most {:g}", *limit.max);
}

std::vector<Limit> limits_in(const Section& section) {
  const std::vector<std::string>& names = measured_names();
  std::vector<Limit> limits;
  for (const std::string& quantity : section.names(TextRule::kName)) {
    if (std::ranges::find(names, quantity) == names.end())
      section.fail(quantity, fmt::format("no such quantity; expected one of {}", fmt::join(names, ", ")));
    const Section edges = section.object(quantity);
    const auto edge = [&](const char* key) {
      const Json value = edges.any(key);
      if (!value.is_number() && edges.has(key))
        edges.fail(key, fmt::format("found {}, expected a number", shown(value)));
      return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
    };
    limits.push_back({quantity, edge("min"), edge("max")});
    if (section.any(quantity).empty()) edges.fail("", "found neither min nor max, expected one or both");
  }
  if (limits.empty()) section.fail("", "found no limit, expected at least one");
  return limits;
}

Result<std::vector<Limit>> parse_limits(std::string_view text, const std::string& where) {
  const auto document = parse_json_object(text, where);
  if (!document) return tl::unexpected<Error>(document.error());
  const Section root(*document);
  auto limits = limits_in(root);
  return root.finish().map([&] { return std::move(limits); });
}

Result<std::vector<Limit>> read_limits(const std::string& path) {
  if (path.empty()) return std::vector<Limit>();
  return read_text_file(path).and_then([&](const std::string& text) { return parse_limits(text, path); });
}

std::vector<LimitCheck> check_limits(const std::vector<Limit>& limits, const std::vector<Measured>& measured) {
  std::vector<LimitCheck> checks;
  for (const Limit& limit : limits) {
    const auto found = std::ranges::find_if(measured, [&](const Measured& m) { return m.quantity == limit.quantity; });
    LimitCheck check{limit, found == measured.end() ? Measured{limit.quantity, "", {}} : *found, false};
    const auto& value = check.measured.value;
    check.pass = value && std::isfinite(*value) && (!limit.min || (*value >= *limit.min && !check.measured.at_most)) &&
                 (!limit.max || *value <= *limit.max);
    checks.push_back(std::move(check));
  }
  return checks;
}

report::Table limits_table(const std::vector<std::pair<std::string, std::vector<LimitCheck>>>& recordings) {
  report::Table table{"limits", "Specification limits",
                      "A value that could not be measured fails its limit. ≤: an upper bound of the value.",
                      report::columns("recording: | quantity: | unit: | at least | at most | measured | verdict:")};
  std::vector<std::string> failed;
  for (const auto& [recording, checks] : recordings) {
    for (const LimitCheck& check : checks) {
      report::Cell measured = report::general_cell(check.measured.value, 5);
      if (check.measured.at_most) measured.text = "≤ " + measured.text;
      table.rows.push_back(
          {recording,
           check.limit.quantity,
           check.measured.unit,
           report::general_cell(check.limit.min, 6),
           report::general_cell(check.limit.max, 6),
           measured,
           {check.pass ? "PASS" : "FAIL", check.pass ? report::Emphasis::kGood : report::Emphasis::kBad}});
      if (check.pass) continue;
      failed.push_back(recordings.size() > 1 ? check.limit.quantity + " on " + recording : check.limit.quantity);
    }
  }
  const std::size_t all = table.rows.size();
  table.meaning = failed.empty()
                      ? fmt::format("PASS: all {} limits are met.", all)
                      : fmt::format("FAIL: {} of {} limits: {}.", failed.size(), all, fmt::join(failed, ", "));
  return table;
}

}  // namespace prism::analysis
