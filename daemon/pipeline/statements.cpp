// SPDX-License-Identifier: MIT
#include "daemon/pipeline/statements.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_member.hpp"
#include "base/text_number.hpp"

namespace prism::pipeline {

JsonTable<Offset> offset_keys() {
  constexpr Range kTimes{0, 1e12};
  return JsonTable<Offset>()
      .number("deg_per_h", kAnyNumber, &Offset::deg_per_h, kRequired)
      .text("reason", &Offset::reason, kRequired)
      .text("model", &Offset::model, kRequired)
      .integer("set_s", kTimes, &Offset::set_s, kRequired)
      .integer("expires_s", kTimes, &Offset::expires_s, "");
}

std::string offset_text(const Offset& offset) {
  const std::string until = offset.expires_s > 0 ? " until " + utc_text(offset.expires_s) : "";
  return fmt::format("{:+.5f} deg/h{}: {}", offset.deg_per_h, until, offset.reason);
}

Result<void> bind_offset(const compensation::ModelPtr& model, Offset& offset) {
  constexpr double kMost = 3;  // standard deviations
  if (!model) return make_error("offset", "found no model, expected one: the offset is a part of its bias");
  const auto& monitor = model->info().monitor;
  const auto& spread = model->info().spread;
  if (!monitor && !spread) return make_error("offset", "the model does not state how runs differ: train it again");
  const double sd = monitor ? monitor->offset_deg_per_h
                            : spread->factor * std::hypot(spread->offset_deg_per_h, spread->nuisance_deg_per_h);
  offset.model = model->info().id;
  if (std::abs(offset.deg_per_h) <= kMost * sd) return {};
  return make_error("offset",
                    fmt::format("found {:g} deg/h, expected at most {:.3g}: {:g} times the {:.3g} deg/h by which "
                                "switch-ons differ in the model; for a larger shift: prismcal train --from",
                                offset.deg_per_h, kMost * sd, kMost, sd));
}

std::string offset_path(const Setup& setup, std::size_t axis) {
  const auto& log = setup.config.log;
  return log ? log->directory + "/" + log_name(setup, axis) + ".offset.json" : "";
}

Result<std::optional<Offset>> load_offset(const std::string& path) {
  if (!FileId::of(path)) return std::nullopt;
  const auto text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  const auto document = parse_json_object(*text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  Section top(*document);
  Offset offset;
  offset_keys().read(top, offset);
  if (auto good = top.finish(); !good) return tl::unexpected<Error>(good.error());
  return offset;
}

Result<void> store_offset(const std::string& path, const std::optional<Offset>& offset) {
  if (offset) return write_text_file(path, json_text(offset_keys().print(*offset), 2) + "\n");
  std::error_code error;
  std::filesystem::remove(path, error);
  if (error) return make_error(path, "cannot be removed: " + error.message());
  sync_directory(std::filesystem::path(path).parent_path().string());
  return {};
}

void forget_offset(const std::string& path, const Offset& ended) {
  const auto found = load_offset(path);
  if (found && *found == ended) (void)store_offset(path, {});
}

constexpr const char* kMonitorFormat = "prism-monitor";

std::string monitor_file(const config::Config& config) {
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

}  // namespace prism::pipeline
