// SPDX-License-Identifier: MIT
#include "config/monitor_file.hpp"

#include <cstdlib>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_table.hpp"

namespace prism::config {
namespace {

constexpr const char* kFormat = "prism-monitor";
constexpr std::size_t kMostBytes = 1 << 16;

JsonTable<ModelVerdict> verdict_keys() {
  using V = ModelVerdict;
  return JsonTable<V>()
      .text("verdict", &V::verdict, kRequired)
      .text("text", &V::text, kRequired)
      .text("model", &V::model, kRequired)
      .integer("at_s", kAnyNumber, &V::at_s, kRequired);
}

}  // namespace

std::string monitor_file(const Config& config) {
  const char* const state = std::getenv("STATE_DIRECTORY");
  if (state != nullptr && *state != '\0') return std::string(state) + "/monitor.json";
  return config.log ? config.log->directory + "/monitor.json" : "";
}

Result<ModelVerdicts> read_verdicts(const std::string& path) {
  const auto text = read_text_file(path, kMostBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  const auto document = parse_json_object(*text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  const Section top(*document);
  if (top.text("format") != kFormat) top.fail("format", std::string("expected \"") + kFormat + "\"");
  ModelVerdicts verdicts;
  const Section axes = top.object("axes");
  for (const std::string& axis : axes.names(TextRule::kText)) verdict_keys().read(axes.object(axis), verdicts[axis]);
  if (auto good = top.finish(); !good) return tl::unexpected<Error>(good.error());
  return verdicts;
}

Result<void> write_verdicts(const std::string& path, const ModelVerdicts& verdicts) {
  Json json = {{"format", kFormat}, {"axes", Json::object()}};
  for (const auto& [axis, verdict] : verdicts) json["axes"][axis] = verdict_keys().print(verdict);
  return write_text_file(path, json_text(json, 2) + "\n");
}

}  // namespace prism::config
