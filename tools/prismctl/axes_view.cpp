// SPDX-License-Identifier: MIT
#include "tools/prismctl/axes_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/escape.hpp"
#include "tools/client/response.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;

constexpr std::size_t kColumns = 80, kLabel = 13, kWidest = 22;

struct Row {
  const char* label;
  std::function<std::string(const json& axis, const json& window)> text;
};

// Members of the window in `status`, and the corresponding ones in `bias`.
const json& either(const json& window, const char* key, const char* other) {
  const json& found = at(window, key);
  return found.is_null() ? at(window, other) : found;
}

const std::vector<Row>& rows() {
  static const std::vector<Row> kRows = {
      {"quality", [](const json& a, const json&) { return text_of(at(a, "quality")); }},
      {"1 s rate",
       [](const json&, const json& w) { return value_text(either(w, "second_rate_deg_per_h", "rate_deg_per_h"), 5); }},
      {"mean rate", [](const json&, const json& w) { return value_text(at(w, "mean_rate_deg_per_h"), 5, " deg/h"); }},
      {"bias", [](const json&, const json& w) { return value_text(at(w, "bias_deg_per_h"), 5, " deg/h"); }},
      {"  sd", [](const json&, const json& w) { return value_text(at(w, "sd_deg_per_h"), 5); }},
      {"corrected",
       [](const json&, const json& w) { return value_text(at(w, "corrected_mean_deg_per_h"), 5, " deg/h"); }},
      {"temperature",
       [](const json&, const json& w) {
         return value_text(either(w, "mean_temperature_degc", "temperature_degc"), 3, " degC");
       }},
      {"slope", [](const json&, const json& w) { return value_text(at(w, "slope_degc_per_s"), 6, " degC/s"); }},
      {"UHFO", [](const json&, const json& w) { return value_text(either(w, "mean_uhfo_v", "uhfo_v"), 4, " V"); }},
      {"model", [](const json& a, const json&) {
         const json& model = at(a, "model");
         return model.is_object() ? text_of(at(model, "name"), "unnamed") : first_bytes(text_of(model, "none"), 12);
       }}};
  return kRows;
}

std::string cell(const std::string& text, std::size_t width) {
  return fmt::format("{:>{}}", text.size() < width ? text : first_bytes(text, width - 2) + ">", width);
}

}  // namespace

json with_only_axis(json result) {
  const json& axes = at(result, "axes");
  if (!axes.is_object() || axes.size() != 1) return result;
  if (result.size() == 1) return json(axes.front());
  const std::string name = axes.begin().key();
  return client::with_axis(std::move(result), name);
}

std::string axes_table(const json& axes, const char* window) {
  const std::size_t width = std::min(kWidest, (kColumns - kLabel) / std::max<std::size_t>(axes.size(), 1));
  std::string text = fmt::format("{:<{}}", "", kLabel);
  for (const auto& [name, axis] : axes.items()) text += cell(printable(name), width);
  text += '\n';
  for (const Row& row : rows()) {
    text += fmt::format("{:<{}}", row.label, kLabel);
    for (const auto& [name, axis] : axes.items()) {
      const json& own = *window == '\0' ? axis : at(axis, window);
      text += cell(row.text(axis, own), width);
    }
    text += '\n';
  }
  return text;
}

std::string each_axis(const json& result, const std::function<std::string(const json&)>& view) {
  const json& axes = at(result, "axes");
  if (!axes.is_object()) return view(result);
  std::string text;
  for (const auto& [name, own] : axes.items()) {
    if (axes.size() > 1) text += (text.empty() ? "" : "\n") + fmt::format("axis {}\n", printable(name));
    text += view(own);
  }
  return text;
}

}  // namespace prism::prismctl
