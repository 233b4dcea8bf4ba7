// SPDX-License-Identifier: MIT
#include "compensation/model_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "base/escape.hpp"
#include "compensation/kernel.hpp"
#include "compensation/model.hpp"

namespace prism::compensation {

JsonTable<Normalisation> normalisation_keys() {
  using N = Normalisation;
  return JsonTable<N>()
      .numbers("input_shift", kAnyNumber, &N::input_shift, kRequired)
      .numbers("input_scale", kPositive, &N::input_scale, kRequired)
      .number("target_shift", kAnyNumber, &N::target_shift, kRequired)
      .number("target_scale", kPositive, &N::target_scale, kRequired);
}

Eigen::MatrixXd symmetric_of(const Section& section, const std::string& key, const std::vector<double>& lower) {
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

Json lower_triangle(const Eigen::MatrixXd& m) {
  Json lower;
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) lower.push_back(m(i, j));
  }
  return lower;
}

void shape_centres(const Section& section, Eigen::MatrixXd& centres, std::size_t inputs, Eigen::Index alphas) {
  const auto d = static_cast<Eigen::Index>(inputs);
  if (!section.good()) return;
  if (centres.size() == d * alphas) return centres.resize(d, alphas);
  section.fail("centres", fmt::format("found {} numbers, expected {}: {} inputs for each of {} alphas", centres.size(),
                                      d * alphas, d, alphas));
}

namespace {

constexpr ModelKind kKinds[] = {
    {"polynomial", polynomial_keys, read_polynomial, print_polynomial},
    {"stepwise", polynomial_keys, read_polynomial, print_polynomial},
    {"lssvm", lssvm_keys, read_lssvm, print_lssvm},
    {"ir_lssvm", lssvm_keys, read_lssvm, print_lssvm},
    {"sparse_lssvm", lssvm_keys, read_lssvm, print_lssvm},
    {"svr", lssvm_keys, read_lssvm, print_lssvm},
    {"composite", composite_keys, read_composite, print_composite},
};

const ModelKind& kind_of(const ModelInfo& info) {
  const auto* const kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                        [&](const ModelKind& other) { return info.kind == other.name; });
  assert(kind != std::end(kKinds));
  return *kind;
}

// A text of the file for error messages: in quotes, escaped and shortened.
std::string in_quotes(const std::string& text) { return shown(nlohmann::json(text)); }

JsonTable<FeatureDefinition> feature_keys() {
  using F = FeatureDefinition;
  const Json unit = {{"type", "string"}, {"enum", kSensorUnitNames}};
  return JsonTable<F>()
      .integer("length_s", {1, 3600}, &F::length_s, kRequired)
      .choice("slope", kSlopeNames, &F::slope, kRequired)
      .custom(
          "end_mean_s", {{"type", "integer"}, {"minimum", 1}, {"maximum", 3600}, {"default", 1}}, "",
          [](const Section& section, F& features) {
            const Range range{1, double(features.length_s)};
            features.end_mean_s = static_cast<int>(section.integer("end_mean_s", range, 1));
          },
          [](const F& features, Json& json) { json["end_mean_s"] = features.end_mean_s; })
      .integer("max_gap_s", {0, 3600}, &F::max_gap_s, kRequired)
      .custom(
          "lag_time_constants_s", {{"type", "array"}, {"maxItems", 0}}, "of prism 0.3 and earlier",
          [](const Section& section, F&) {
            constexpr const char* kKey = "lag_time_constants_s";
            if (section.has(kKey) && !section.numbers(kKey, kAnyNumber).empty())
              section.fail(kKey, "lagged inputs were removed: train again, with --response");
          },
          nullptr)
      .custom(
          "sensors", {{"type", "object"}, {"additionalProperties", unit}},
          "sensors used by the inputs, with their units",
          [](const Section& section, F& features) {
            const Section sensors = section.object("sensors");
            for (const std::string& name : sensors.names(TextRule::kSensorName)) {
              if (!is_sensor_name(name)) sensors.fail(name, "is the name of another input, expected a sensor's");
              features.sensors.push_back({name, kSensorUnitNames[sensors.choice(name, kSensorUnitNames)]});
            }
          },
          [](const F& features, Json& json) {
            for (const SensorName& sensor : features.sensors) json["sensors"][sensor.name] = sensor.unit;
          })
      .object(
          "response_s", JsonTable<F>().integer("T", {1, 1e6}, &F::response_s, kRequired),
          [](auto& features) -> auto& { return features; }, "time constant with which the gyro's body follows T")
      .print_if([](const F& features) { return features.response_s > 0; });
}

// The inputs of a table model have the units of the table.
std::string unit_of(const ModelInfo& info, const std::string& input) {
  return info.table ? "" : unit_of_input(info.features, input);
}

struct InputDraft {
  std::string name, unit;
  std::optional<double> min, max;
};

JsonTable<InputDraft> input_keys() {
  using I = InputDraft;
  return JsonTable<I>()
      .text("name", &I::name, kRequired)
      .text("unit", &I::unit, "")
      .number("min", kAnyNumber, &I::min, "")
      .number("max", kAnyNumber, &I::max, "")
      .then([](const Section& section, I& input) {  // both ends of the training box or none
        if (!input.min && !input.max) return;
        section.require("min"), section.require("max");
        if (section.good() && *input.max < *input.min)
          section.fail("max", fmt::format("{} is less than min, {}", *input.max, *input.min));
      });
}

void add_input(const Section& section, const std::string&, const InputDraft& input, ModelInfo& info) {
  if (info.table) section.text("name", {}, TextRule::kText);
  if (!info.table && !has_input(info.features, input.name)) {
    section.fail(
        "name", fmt::format("found {}, expected T, dTdt, U or a sensor's that features define", in_quotes(input.name)));
  }
  if (std::count(info.inputs.begin(), info.inputs.end(), input.name))
    section.fail("name", in_quotes(input.name) + " is given twice");
  if (const std::string expected = unit_of(info, input.name); section.has("unit") && input.unit != expected)
    section.fail("unit", fmt::format("found {}, expected \"{}\"", in_quotes(input.unit), expected));
  info.inputs.push_back(input.name);
  if (!input.min || !input.max) return;
  info.domain.min.push_back(*input.min);
  info.domain.max.push_back(*input.max);
}

void print_inputs(const ModelInfo& info, Json& json) {
  for (std::size_t i = 0; i < info.inputs.size(); ++i) {
    InputDraft input{info.inputs[i], unit_of(info, info.inputs[i]), {}, {}};
    if (!info.domain.min.empty()) input.min = info.domain.min[i], input.max = info.domain.max[i];
    json["inputs"].push_back(input_keys().print(input));
  }
}

void check_inputs(const Section& top, ModelInfo& info) {
  if (info.inputs.empty()) top.fail("inputs", "found none, expected at least one input");
  if (const std::size_t ranges = info.domain.min.size(); ranges != 0 && ranges != info.inputs.size()) {
    top.fail("inputs", fmt::format("found min and max of {} of {} inputs, expected them of all or of none", ranges,
                                   info.inputs.size()));
  }
}

JsonTable<BetweenRunError> spread_keys() {
  using B = BetweenRunError;
  return JsonTable<B>()
      .number("nuisance_deg_per_h", {0, 1e9}, &B::nuisance_deg_per_h, kRequired)
      .number("offset_deg_per_h", {0, 1e9}, &B::offset_deg_per_h, kRequired)
      .number("noise_deg_per_h", {0, 1e9}, &B::noise_deg_per_h, kRequired)
      .number("factor", {1e-6, 1e6}, &B::factor, "")
      .integer("blocks", {0, 1e9}, &B::blocks, kRequired)
      .integer("samples", {0, 1e9}, &B::samples, kRequired);
}

JsonTable<RateNoise> noise_keys() {
  using N = RateNoise;
  return JsonTable<N>()
      .number("n_deg_per_sqrt_h", kPositive, &N::n_deg_per_sqrt_h, {kRequired, "angle random walk"})
      .number("b_deg_per_h", {0, 1e9}, &N::b_deg_per_h, {kRequired, "bias instability"})
      .number("second_deg_per_h", kPositive, &N::second_deg_per_h,
              {kRequired, "sd of one-second means within a window"});
}

JsonTable<MonitorSettings> monitor_keys() {
  using M = MonitorSettings;
  return JsonTable<M>()
      .integer("every", {1, 1e6}, &M::every, {kRequired, "windows per value"})
      .number("sd_deg_per_h", kPositive, &M::sd_deg_per_h, {kRequired, "of the values"})
      .number("offset_deg_per_h", {0, 1e9}, &M::offset_deg_per_h, {kRequired, "sd between switch-ons"})
      .number("correlation", {-1, 1}, &M::correlation, {kRequired, "of neighbouring values"})
      .number("threshold", kPositive, &M::threshold, {kRequired, "of the sums, in sd"})
      .number("delay_h", kPositive, &M::delay_h, {kRequired, "time at rest that finds a shift of 1 sd"})
      .integer("since_s", {0, 1e12}, &M::since_s, "time of the first row to test, s since 1970: of train --from")
      .print_if([](const M& monitor) { return monitor.since_s > 0; });
}

// Checks format and version before any other key.
void read_format(const Section& top, ModelInfo& info) {
  const std::string format = top.text("format");
  if (top.good() && format != "prism-model")
    top.fail("format",
             fmt::format("found {}, expected \"prism-model\": a model made by prismcal train", in_quotes(format)));
  const auto version = top.integer("version", {1, 1e9});
  if (top.good() && version > kModelVersion) {
    top.fail("version", fmt::format("found {}, expected at most {}: made by a newer prism", version, kModelVersion));
  }
  info.id_has_serial = version > 1;
}

void read_provenance(const Section& top, ModelInfo& info) {
  const nlohmann::json provenance = top.any("provenance");  // sorted, as in all earlier versions
  if (!provenance.is_null() && !provenance.is_object())
    top.fail("provenance", "found " + shown(provenance) + ", expected an object {...}");
  info.provenance_json = provenance.is_null() ? "{}" : json_text(provenance);
}

// The keys of every type.
const JsonTable<ModelInfo>& model_keys() {
  using M = ModelInfo;
  std::vector<const char*> kinds;
  for (const ModelKind& kind : kKinds) kinds.push_back(kind.name);
  const auto gyro = JsonTable<M>()
                        .text("serial", &M::gyro_serial, "", TextRule::kText)
                        .text("axis", &M::gyro_axis, "", TextRule::kAxisName)
                        .print_if([](const M& info) { return model_version(info) > 1 && !info.gyro_axis.empty(); });
  static const JsonTable<M> keys =
      JsonTable<M>()
          .custom("format", {{"const", "prism-model"}}, "", read_format,
                  [](const M&, Json& json) { json["format"] = "prism-model"; })
          .also({}, true)
          .known("version", {{"enum", {1, 2, 3}}}, "2: the id covers gyro/serial; 3: with a response")
          .also({}, true)
          .print_by([](const M& info, Json& json) { json["version"] = model_version(info); })
          .text("id", &M::id, {kRequired, "SHA-256 of the numbers"})
          .also({{"pattern", "^[0-9a-f]{64}$"}})
          .choice("kind", kinds, &M::kind, kRequired)
          .text("name", &M::name, "", TextRule::kText)
          .object("gyro", gyro, std::identity(), "")
          .then([](const Section&, M& info) {
            if (model_version(info) == 1) info.gyro_axis.clear();  // not covered by the id
          })
          .boolean("table", &M::table, "trained on a table without timestamps: no features")
          .print_if([](const M& info) { return info.table; })
          .object("features", feature_keys(), &M::features, "")
          .read_by([features = feature_keys()](const Section& top, M& info) {
            if (!info.table) features.read(top.object("features", true), info.features);
          })
          .print_if([](const M& info) { return !info.table; })
          .objects(JsonTable<M>::Form::kList, "inputs", input_keys(), add_input, kRequired)
          .print_by(print_inputs)
          .also({{"minItems", 1}})
          .then(check_inputs)
          .object("spread", spread_keys(), &M::spread, "error of the model in an unseen run")
          .object("rate_noise", noise_keys(), &M::noise, "of the corrected rate in the training; not part of the id")
          .object("monitor", monitor_keys(), &M::monitor, "for prismcal monitor; not part of the id")
          .custom("provenance", {{"type", "object"}}, "", read_provenance, nullptr);
  return keys;
}

}  // namespace

Json model_schema() {
  Json schema = schema_of_file("prism", "compensation", model_keys().schema());
  schema["title"] = "prism bias model";
  for (const ModelKind& kind : kKinds) schema["properties"].update(kind.keys());
  return schema;
}

Result<ModelPtr> read_model(Section& top) {
  const std::string where = top.where();
  ModelInfo info;
  model_keys().read(top, info);
  if (!top.good()) return tl::unexpected<Error>(top.finish().error());
  const std::string stated = info.id;
  Result<ModelPtr> model = kind_of(info).read(top, std::move(info));
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

/// A value as it is in the file: objects on one line, without null members; lists of objects or of many numbers in
/// rows.
std::string value_text(const Json& value) {
  constexpr std::size_t kInRow = 8;
  if (value.is_number_float()) return exact_text(value.get<double>());
  if (!value.is_structured()) return json_text(value);
  if (value.is_object()) {
    std::string text;
    for (const auto& [key, member] : value.items()) {
      if (member.is_null()) continue;
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", json_text(Json(key)),
                          key == "provenance" ? json_text(member) : value_text(member));
    }
    return "{" + text + "}";
  }
  const bool of_objects = !value.empty() && value.front().is_object(), rows = of_objects || value.size() > kInRow;
  std::string text;
  for (std::size_t i = 0; i < value.size(); ++i) {
    text += i > 0 ? "," : "";
    text += rows && (of_objects || i % kInRow == 0) ? "\n    " : i > 0 ? " " : "";
    text += value_text(value[i]);
  }
  return "[" + text + (rows ? "\n  ]" : "]");
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

std::string format_model(const Model& model) {
  return format_model(model, model.info().provenance_json, model.info().noise, model.info().monitor);
}

std::string format_model(const Model& model, const std::string& provenance_json, const std::optional<RateNoise>& noise,
                         const std::optional<MonitorSettings>& monitor) {
  ModelInfo info = model.info();
  info.noise = noise;
  info.monitor = monitor;
  Json json = model_keys().print(info);
  json.update(kind_of(info).print(model));
  std::string text = "{\n";
  for (const auto& [key, value] : json.items()) {
    if (!value.is_null()) text += fmt::format("  \"{}\": {},\n", key, value_text(value));
  }
  return text += fmt::format("  \"provenance\": {}\n}}\n", provenance_json.empty() ? "{}" : provenance_json);
}

}  // namespace prism::compensation
