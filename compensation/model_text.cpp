// SPDX-License-Identifier: MIT
#include "compensation/model_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "compensation/json_section.hpp"
#include "compensation/model_kinds.hpp"

namespace prism {
namespace {

FeatureDefinition read_features(Section section) {
  FeatureDefinition features;
  features.length_s = static_cast<int>(section.integer("length_s", {1, 3600}));
  features.slope = static_cast<SlopeMethod>(section.choice("slope", kSlopeNames));
  features.end_mean_s = static_cast<int>(section.integer("end_mean_s", {1, double(features.length_s)}, 1));
  features.max_gap_s = static_cast<int>(section.integer("max_gap_s", {0, 3600}));
  features.lag_time_constants_s = section.numbers("lag_time_constants_s", {1, 1e7}, false);
  return features;
}

void read_inputs(Section& top, ModelInfo& info) {
  bool bounded = true;
  for (Section& input : top.objects("inputs")) {
    const std::string name = input.text("name", "");
    if (!has_input(info.features, name)) {
      input.fail("name", fmt::format("found \"{}\", expected T, dTdt, U or a lag that features define", name));
    }
    input.text("unit", "");
    info.inputs.push_back(name);
    bounded = bounded && input.has("min") && input.has("max");
    info.domain.min.push_back(input.number("min", kAnyNumber, 0.0));
    info.domain.max.push_back(input.number("max", kAnyNumber, 0.0));
  }
  if (!bounded) info.domain = {};
  if (info.inputs.empty()) top.fail("inputs", "found none, expected at least one input");
}

Result<ModelPtr> read_model(Section& top, const std::string& where) {
  ModelInfo info;
  info.kind = top.text("kind");
  info.name = top.text("name", "");
  info.id = top.text("id");
  info.gyro_serial = top.object("gyro").text("serial", "");
  info.features = read_features(top.object("features", true));
  read_inputs(top, info);
  const nlohmann::json provenance = top.any("provenance");
  info.provenance_json = provenance.is_null() ? "{}" : provenance.dump();
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  const std::string stated = info.id;
  const ModelKind* kind = find_model_kind(info.kind);
  if (kind == nullptr) return refuse(where + ":/kind", fmt::format("found \"{}\", expected {}", info.kind, model_kind_names()));
  Result<ModelPtr> model = kind->read(top, std::move(info));
  if (auto rest = top.finish(); !rest) return tl::unexpected<Error>(rest.error());
  if (model && (*model)->info().id != stated) {
    return refuse(where + ":/id", fmt::format("found \"{:.12}…\", expected \"{:.12}…\": the content was changed or damaged",
                                              stated, (*model)->info().id));
  }
  return model;
}

const char* unit_of(const std::string& input) {
  if (input == kInputSlope) return "degC/s";
  return input == kInputUhfo ? "V" : "degC";
}

}  // namespace

Result<ModelPtr> parse_model(std::string_view text, std::string_view where) {
  const std::string place(where);
  const Result<nlohmann::json> json = parse_json_object(text, where);
  if (!json) return tl::unexpected<Error>(json.error());
  Section top(*json, place);
  const std::string format = top.text("format", "");
  if (format != "prism-model") return refuse(place + ":/format", fmt::format("found \"{}\", expected \"prism-model\"", format));
  const auto version = top.integer("version", {1, 1e9});
  if (top.good() && version > kModelVersion) {
    return refuse(place + ":/version", fmt::format("found {}, expected at most {}: made by a newer prism", version, kModelVersion));
  }
  return read_model(top, place);
}

std::string format_model(const Model& model) {
  const ModelInfo& info = model.info();
  const FeatureDefinition& f = info.features;
  const auto quoted = [](const std::string& s) { return nlohmann::json(s).dump(); };
  std::string text = fmt::format(
      "{{\n  \"format\": \"prism-model\",\n  \"version\": {},\n  \"id\": \"{}\",\n  \"kind\": {},\n  \"name\": {},\n", kModelVersion,
      info.id, quoted(info.kind), quoted(info.name));
  text += fmt::format("  \"gyro\": {{\"serial\": {}}},\n", quoted(info.gyro_serial));
  text += fmt::format(
      "  \"features\": {{\"length_s\": {}, \"slope\": \"{}\", \"end_mean_s\": {}, \"max_gap_s\": {}, "
      "\"lag_time_constants_s\": {}}},\n  \"inputs\": [",
      f.length_s, kSlopeNames[static_cast<std::size_t>(f.slope)], f.end_mean_s, f.max_gap_s, exact_texts(f.lag_time_constants_s));
  for (std::size_t i = 0; i < info.inputs.size(); ++i) {
    text += fmt::format("{}\n    {{\"name\": \"{}\", \"unit\": \"{}\"", i ? "," : "", info.inputs[i], unit_of(info.inputs[i]));
    if (!info.domain.min.empty()) {
      text += fmt::format(", \"min\": {}, \"max\": {}", exact_text(info.domain.min[i]), exact_text(info.domain.max[i]));
    }
    text += "}";
  }
  text += "\n  ],\n";
  text += find_model_kind(info.kind)->content(model);
  return text += fmt::format("  \"provenance\": {}\n}}\n", info.provenance_json);
}

}  // namespace prism
