// SPDX-License-Identifier: MIT
#include "compensation/model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/sha256.hpp"

namespace prism::compensation {
namespace {

// In a repeat of the same profile, an input that varies from run to run often leaves the box of one record.
constexpr double kBoxMargin = 0.02, kWanderingMargin = 0.2;  // in multiples of the range
constexpr double kGridPoints = 1024;
constexpr std::size_t kGridInputs = 10;  // with more inputs not even the corners fit
constexpr double kGridSide = 65;         // points of a single input

}  // namespace

double margin_of(const ModelInfo& info, std::size_t input) {
  if (!info.spread) return 0;
  const std::string& name = info.inputs[input];
  const bool wanders = !info.table && (name == kInputSlope || name == kInputUhfo);
  return wanders ? kWanderingMargin : kBoxMargin;
}

Model::Model(ModelInfo info, std::string_view content) : info_(std::move(info)) { info_.id = model_id(info_, content); }

bool Model::outside_domain(std::span<const double> inputs) const {
  const Domain& domain = info_.domain;
  for (std::size_t i = 0; i < domain.min.size(); ++i) {
    const double room = margin_of(info_, i) * (domain.max[i] - domain.min[i]);
    if (inputs[i] < domain.min[i] - room || inputs[i] > domain.max[i] + room) return true;
  }
  return false;
}

double Model::excess(std::span<const double> inputs, std::span<const double> shares) const {
  const Domain& domain = info_.domain;
  double most = 0, squares = 0;
  for (std::size_t i = 0; i < domain.min.size(); ++i) {
    const double range = domain.max[i] - domain.min[i];
    if (!(range > 0)) continue;
    const double outside = std::max({0.0, (domain.min[i] - inputs[i]) / range, (inputs[i] - domain.max[i]) / range});
    most = std::max(most, outside);
    if (!shares.empty()) squares += shares[i] * outside * outside;
  }
  return shares.empty() ? most : std::sqrt(squares);
}

void Model::measure_bias_span() {
  const Domain& box = info_.domain;
  const std::size_t inputs = box.min.size();
  if (inputs == 0 || inputs > kGridInputs || inputs != info_.inputs.size()) return;
  // The largest integer side whose power is at most kGridPoints; adding 0.5 prevents truncation of an exact root.
  const double root = std::pow(kGridPoints + 0.5, 1 / static_cast<double>(inputs));
  const auto side = static_cast<std::size_t>(std::min(root, kGridSide));
  std::vector<std::size_t> at(inputs, 0);
  std::vector<double> point = box.min;
  double low = bias_deg_per_h(point), high = low;
  for (std::size_t i = 0; i < inputs;) {
    if (++at[i] == side) at[i] = 0;
    const double part = static_cast<double>(at[i]) / static_cast<double>(side - 1);
    point[i] = box.min[i] + part * (box.max[i] - box.min[i]);
    if (at[i] == 0) {
      ++i;  // carry
      continue;
    }
    const double bias = bias_deg_per_h(point);
    low = std::min(low, bias);
    high = std::max(high, bias);
    i = 0;
  }
  if (std::isfinite(high - low)) bias_span_deg_per_h_ = high - low;
}

std::vector<double> gather_inputs(const Model& model, const Window& window) {
  std::vector<double> inputs;
  for (const std::string& name : model.info().inputs) {
    const double value = input_value(window, model.info().features, name);
    if (!std::isfinite(value)) return {};
    inputs.push_back(value);
  }
  return inputs;
}

// JSON's "-0" is an integer and reads back as +0: an id over "-0" would not match the file.
std::string exact_text(double value) { return value == 0 && std::signbit(value) ? "-0.0" : fmt::format("{}", value); }

std::string exact_texts(std::span<const double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + exact_text(value);
  return "[" + text + "]";
}

int model_version(const ModelInfo& info) {
  if (info.features.response_s > 0) return kModelVersion;
  return info.id_has_serial && !info.gyro_serial.empty() ? 2 : 1;
}

std::string model_id(const ModelInfo& info, std::string_view content) {
  const FeatureDefinition& f = info.features;
  std::string canonical =
      fmt::format("prism-model {} {}\n{} {} {} {} []\n{}\n{} {}\n", model_version(info), info.kind, f.length_s,
                  kSlopeNames[static_cast<std::size_t>(f.slope)], f.end_mean_s, f.max_gap_s,
                  fmt::join(info.inputs, " "), exact_texts(info.domain.min), exact_texts(info.domain.max));
  if (model_version(info) > 1) {
    canonical += "serial " + info.gyro_serial + "\n";
    if (!info.gyro_axis.empty()) canonical += "axis " + info.gyro_axis + "\n";
  }
  if (f.response_s > 0) canonical += fmt::format("response T {}\n", f.response_s);
  if (info.table) canonical += "table\n";
  for (const SensorName& sensor : f.sensors) canonical += fmt::format("sensor {} {}\n", sensor.name, sensor.unit);
  if (const auto& s = info.spread) {
    canonical +=
        fmt::format("spread {} {} {}\n",
                    exact_texts(std::vector{s->nuisance_deg_per_h, s->offset_deg_per_h, s->noise_deg_per_h, s->factor}),
                    s->blocks, s->samples);
  }
  return sha256_hex(canonical += content);
}

}  // namespace prism::compensation
