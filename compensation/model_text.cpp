// SPDX-License-Identifier: MIT
#include "compensation/model_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/escape.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

Eigen::VectorXd vector_of(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Normalisation read_normalisation(Section section) {
  Normalisation n;
  n.input_shift = vector_of(section.numbers("input_shift", kAnyNumber));
  n.input_scale = vector_of(section.numbers("input_scale", kPositive));
  n.target_shift = section.number("target_shift", kAnyNumber);
  n.target_scale = section.number("target_scale", kPositive);
  return n;
}

Eigen::MatrixXd symmetric_of(Section& section, const char* key, const std::vector<double>& lower) {
  const auto n = static_cast<Eigen::Index>((std::sqrt(8.0 * static_cast<double>(lower.size()) + 1) - 1) / 2 + 0.5);
  if (static_cast<std::size_t>(n * (n + 1) / 2) != lower.size()) {
    section.fail(key, fmt::format("found {} numbers, expected n (n + 1) / 2", lower.size()));
    return {};
  }
  Eigen::MatrixXd m(n, n);
  std::size_t at = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) m(i, j) = m(j, i) = lower[at++];
  }
  return m;
}

Eigen::MatrixXd centres_of(Section& section, const std::vector<double>& numbers, std::size_t inputs,
                           Eigen::Index alphas) {
  const auto d = static_cast<Eigen::Index>(inputs);
  if (section.good() && static_cast<Eigen::Index>(numbers.size()) != d * alphas) {
    section.fail("centres", fmt::format("found {} numbers, expected {}: {} inputs for each of {} alphas",
                                        numbers.size(), d * alphas, d, alphas));
  }
  if (!section.good()) return {};
  return Eigen::Map<const Eigen::MatrixXd>(numbers.data(), d, alphas);
}

std::string normalisation_text(const Normalisation& n) {
  return fmt::format(
      "  \"normalisation\": {{\"input_shift\": {}, \"input_scale\": {}, \"target_shift\": {}, \"target_scale\": "
      "{}}},\n",
      exact_numbers(n.input_shift), exact_numbers(n.input_scale), exact_text(n.target_shift),
      exact_text(n.target_scale));
}

void append_rows(std::string& text, const char* key, const Eigen::MatrixXd& values, Eigen::Index width) {
  text += fmt::format("  \"{}\": [", key);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (i % width == 0) text += i > 0 ? ",\n    " : "\n    ";
    text += fmt::format("{}{}", i % width ? ", " : "", exact_text(values.data()[i]));
  }
  text += "\n  ],\n";
}

std::string triangle_text(const Eigen::MatrixXd& m) {
  std::string text;
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    text += i == 0 ? "    " : ",\n    ";
    for (Eigen::Index j = 0; j <= i; ++j) text += (j ? ", " : "") + exact_text(m(i, j));
  }
  return text;
}

namespace {

constexpr ModelKind kKinds[] = {
    {"polynomial", read_polynomial, polynomial_content},
    {"stepwise", read_polynomial, polynomial_content},
    {"lssvm", read_lssvm, lssvm_content},
    {"ir_lssvm", read_lssvm, lssvm_content},
    {"sparse_lssvm", read_lssvm, lssvm_content},
    {"svr", read_lssvm, lssvm_content},
    {"composite", read_composite, composite_content},
};

}  // namespace

const ModelKind* find_model_kind(std::string_view name) {
  for (const ModelKind& kind : kKinds) {
    if (name == kind.name) return &kind;
  }
  return nullptr;
}

std::string model_kind_names() {
  std::string names;
  for (const ModelKind& kind : kKinds) names += std::string(names.empty() ? "" : ", ") + '"' + kind.name + '"';
  return names;
}

namespace {

// A text of the file for error messages: in quotes, escaped and shortened.
std::string in_quotes(const std::string& text) { return shown(nlohmann::json(text)); }

FeatureDefinition read_features(Section section) {
  FeatureDefinition features;
  features.length_s = static_cast<int>(section.integer("length_s", {1, 3600}));
  features.slope = static_cast<SlopeMethod>(section.choice("slope", kSlopeNames));
  features.end_mean_s = static_cast<int>(section.integer("end_mean_s", {1, double(features.length_s)}, 1));
  features.max_gap_s = static_cast<int>(section.integer("max_gap_s", {0, 3600}));
  features.lag_time_constants_s = section.numbers("lag_time_constants_s", {1, 1e7}, false);
  const Section sensors = section.object("sensors");
  for (const std::string& name : sensors.names(TextRule::kSensorName)) {
    if (!is_sensor_name(name)) sensors.fail(name, "is the name of another input, expected a sensor's");
    features.sensors.push_back({name, kSensorUnitNames[sensors.choice(name, kSensorUnitNames)]});
  }
  return features;
}

// The inputs of a table model have the units of the table.
std::string unit_of(const ModelInfo& info, const std::string& input) {
  return info.table ? "" : unit_of_input(info.features, input);
}

// Both ends of the training box or none: one end alone is an error.
void read_range(Section& input, Domain& domain) {
  if (!input.has("min") && !input.has("max")) return;
  const double min = input.number("min", kAnyNumber);
  domain.max.push_back(input.number("max", kAnyNumber));
  domain.min.push_back(min);
  if (domain.max.back() < min) input.fail("max", fmt::format("{} is less than min, {}", domain.max.back(), min));
}

void read_inputs(Section& top, ModelInfo& info) {
  for (Section& input : top.objects("inputs")) {
    const std::string name = input.text("name", {}, info.table ? TextRule::kText : TextRule::kLongText);
    if (!info.table && !has_input(info.features, name)) {
      input.fail("name", fmt::format("found {}, expected T, dTdt, U, a lag or a sensor's that features define",
                                     in_quotes(name)));
    }
    if (std::count(info.inputs.begin(), info.inputs.end(), name))
      input.fail("name", in_quotes(name) + " is given twice");
    const std::string expected = unit_of(info, name);
    if (const std::string unit = input.text("unit", expected); unit != expected) {
      input.fail("unit", fmt::format("found {}, expected \"{}\"", in_quotes(unit), expected));
    }
    info.inputs.push_back(name);
    read_range(input, info.domain);
  }
  if (info.inputs.empty()) top.fail("inputs", "found none, expected at least one input");
  if (const std::size_t ranges = info.domain.min.size(); ranges != 0 && ranges != info.inputs.size()) {
    top.fail("inputs", fmt::format("found min and max of {} of {} inputs, expected them of all or of none", ranges,
                                   info.inputs.size()));
  }
}

BetweenRunError read_spread(Section section) {
  BetweenRunError s;
  s.nuisance_deg_per_h = section.number("nuisance_deg_per_h", {0, 1e9});
  s.offset_deg_per_h = section.number("offset_deg_per_h", {0, 1e9});
  s.noise_deg_per_h = section.number("noise_deg_per_h", {0, 1e9});
  s.factor = section.number("factor", {1e-6, 1e6}, 1.0);
  s.blocks = static_cast<int>(section.integer("blocks", {0, 1e9}));
  s.samples = static_cast<int>(section.integer("samples", {0, 1e9}));
  return s;
}

std::string spread_text(const BetweenRunError& s) {
  return fmt::format(
      "  \"spread\": {{\"nuisance_deg_per_h\": {}, \"offset_deg_per_h\": {}, \"noise_deg_per_h\": {}, \"factor\": {}, "
      "\"blocks\": {}, \"samples\": {}}},\n",
      exact_text(s.nuisance_deg_per_h), exact_text(s.offset_deg_per_h), exact_text(s.noise_deg_per_h),
      exact_text(s.factor), s.blocks, s.samples);
}

// Checks format and version before any other key.
std::int64_t read_format(Section& top) {
  const std::string format = top.text("format");
  if (top.good() && format != "prism-model")
    top.fail("format",
             fmt::format("found {}, expected \"prism-model\": a model made by prismcal train", in_quotes(format)));
  const auto version = top.integer("version", {1, 1e9});
  if (top.good() && version > kModelVersion) {
    top.fail("version", fmt::format("found {}, expected at most {}: made by a newer prism", version, kModelVersion));
  }
  return version;
}

}  // namespace

Result<ModelPtr> read_model(Section& top) {
  const std::string where = top.where();
  ModelInfo info;
  info.id_has_serial = read_format(top) > 1;
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  info.kind = top.text("kind");
  info.name = top.text("name", "", TextRule::kText);
  info.id = top.text("id");
  const Section gyro = top.object("gyro");
  info.gyro_serial = gyro.text("serial", "", TextRule::kText);
  info.gyro_axis = gyro.text("axis", "", TextRule::kAxisName);
  if (model_version(info) == 1) info.gyro_axis.clear();  // not covered by the id
  info.table = top.boolean("table", false);
  if (!info.table) info.features = read_features(top.object("features", true));
  read_inputs(top, info);
  if (top.has("spread")) info.spread.emplace(read_spread(top.object("spread")));
  const nlohmann::json provenance = top.any("provenance");  // sorted, as in all earlier versions
  if (!provenance.is_null() && !provenance.is_object()) {
    top.fail("provenance", "found " + shown(provenance) + ", expected an object {...}");
  }
  info.provenance_json = provenance.is_null() ? "{}" : json_text(provenance);
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  const std::string stated = info.id;
  const ModelKind* kind = find_model_kind(info.kind);
  if (kind == nullptr) {
    top.fail("kind", fmt::format("found {}, expected {}", in_quotes(info.kind), model_kind_names()));
    return tl::unexpected<Error>(top.finish().error());
  }
  Result<ModelPtr> model = kind->read(top, std::move(info));
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  if (!model) return make_error(where, model.error().text());
  if ((*model)->info().id != stated) {
    return make_error(where + ":/id",
                      fmt::format("found {}, but the content gives \"{:.12}...\": it was changed or damaged",
                                  in_quotes(stated), (*model)->info().id));
  }
  return model;
}

namespace {

std::string features_text(const FeatureDefinition& f) {
  std::string sensors;
  for (const SensorName& sensor : f.sensors)
    sensors += fmt::format("{}\"{}\": \"{}\"", sensors.empty() ? ", \"sensors\": {" : ", ", sensor.name, sensor.unit);
  if (!sensors.empty()) sensors += "}";
  return fmt::format(
      "  \"features\": {{\"length_s\": {}, \"slope\": \"{}\", \"end_mean_s\": {}, \"max_gap_s\": {}, "
      "\"lag_time_constants_s\": {}{}}},\n",
      f.length_s, kSlopeNames[static_cast<std::size_t>(f.slope)], f.end_mean_s, f.max_gap_s,
      exact_texts(f.lag_time_constants_s), sensors);
}

}  // namespace

Result<ModelPtr> parse_model(std::string_view text, std::string_view where) {
  // Another type of file, such as a table. Comments may precede the object.
  if (const std::size_t first = text.find_first_not_of(" \t\r\n");
      first != text.npos && std::string_view("{[/").find(text[first]) == text.npos)
    return make_error(std::string(where), "found no JSON object, expected a model made by prismcal train");
  const Result<JsonDocument> document = parse_json_object(text, where);
  if (!document) return tl::unexpected<Error>(document.error());
  Section top(*document);
  Result<ModelPtr> model = read_model(top);
  if (auto rest = top.finish(); !rest) return tl::unexpected<Error>(rest.error());
  return model;
}

std::string format_model(const Model& model) { return format_model(model, model.info().provenance_json); }

std::string format_model(const Model& model, const std::string& provenance_json) {
  const ModelInfo& info = model.info();
  const auto quoted = [](const std::string& text) { return json_text(nlohmann::json(text)); };
  std::string text = fmt::format(
      "{{\n  \"format\": \"prism-model\",\n  \"version\": {},\n  \"id\": \"{}\",\n  \"kind\": {},\n  \"name\": {},\n",
      model_version(info), info.id, quoted(info.kind), quoted(info.name));
  text += fmt::format("  \"gyro\": {{\"serial\": {}", quoted(info.gyro_serial));
  if (model_version(info) > 1 && !info.gyro_axis.empty()) text += ", \"axis\": " + quoted(info.gyro_axis);
  text += "},\n";
  text += info.table ? "  \"table\": true,\n" : features_text(info.features);
  text += "  \"inputs\": [";
  for (std::size_t i = 0; i < info.inputs.size(); ++i) {
    text += fmt::format("{}\n    {{\"name\": {}, \"unit\": \"{}\"", i ? "," : "", quoted(info.inputs[i]),
                        unit_of(info, info.inputs[i]));
    if (!info.domain.min.empty()) {
      text += fmt::format(", \"min\": {}, \"max\": {}", exact_text(info.domain.min[i]), exact_text(info.domain.max[i]));
    }
    text += "}";
  }
  text += "\n  ],\n";
  if (info.spread) text += spread_text(*info.spread);
  text += find_model_kind(info.kind)->content(model);
  return text += fmt::format("  \"provenance\": {}\n}}\n", provenance_json.empty() ? "{}" : provenance_json);
}

}  // namespace prism::compensation
