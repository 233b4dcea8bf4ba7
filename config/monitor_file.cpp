// SPDX-License-Identifier: MIT
#include "config/monitor_file.hpp"

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_member.hpp"

namespace prism::config {

constexpr const char* kMonitorFormat = "prism-monitor";

std::string monitor_file(const Config& config) {
  const char* const state = std::getenv("STATE_DIRECTORY");
  if (state != nullptr && *state != '\0') return std::string(state) + "/monitor.json";
  return config.log ? config.log->directory + "/monitor.json" : "";
}

ModelVerdicts read_verdicts(const std::string& path) {
  constexpr std::size_t kMostBytes = 1 << 16;
  const auto text = read_text_file(path, kMostBytes);
  const nlohmann::json json = text ? parse_json_line(*text).value_or(nullptr) : nullptr;
  ModelVerdicts verdicts;
  if (text_member(json, "format") != kMonitorFormat) return verdicts;
  for (const auto& [axis, own] : member(json, "axes").items())
    verdicts[axis] = {text_member(own, "verdict"), printable(text_member(own, "text")), text_member(own, "model"),
                      static_cast<std::int64_t>(count_member(own, "at_s"))};
  return verdicts;
}

Result<void> write_verdicts(const std::string& path, const ModelVerdicts& verdicts) {
  nlohmann::ordered_json json = {{"format", kMonitorFormat}, {"axes", nlohmann::ordered_json::object()}};
  for (const auto& [axis, own] : verdicts)
    json["axes"][axis] = {{"verdict", own.verdict}, {"text", own.text}, {"model", own.model}, {"at_s", own.at_s}};
  return write_text_file(path, json_text(json, 2) + "\n");
}

}  // namespace prism::config
