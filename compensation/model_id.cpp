// SPDX-License-Identifier: MIT
#include "compensation/model_id.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/sha256.hpp"

namespace prism::compensation {

// JSON's "-0" is an integer and reads back as +0: an id over "-0" would not match the file.
std::string exact_text(double value) { return value == 0 && std::signbit(value) ? "-0.0" : fmt::format("{}", value); }

std::string exact_texts(std::span<const double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + exact_text(value);
  return "[" + text + "]";
}

int model_version(const ModelInfo& info) { return info.id_has_serial && !info.gyro_serial.empty() ? kModelVersion : 1; }

std::string model_id(const ModelInfo& info, std::string_view content) {
  const FeatureDefinition& f = info.features;
  std::string canonical = fmt::format("prism-model {} {}\n{} {} {} {} {}\n{}\n{} {}\n", model_version(info), info.kind,
                                      f.length_s, kSlopeNames[static_cast<std::size_t>(f.slope)], f.end_mean_s,
                                      f.max_gap_s, exact_texts(f.lag_time_constants_s), fmt::join(info.inputs, " "),
                                      exact_texts(info.domain.min), exact_texts(info.domain.max));
  if (model_version(info) > 1) {
    canonical += "serial " + info.gyro_serial + "\n";
    if (!info.gyro_axis.empty()) canonical += "axis " + info.gyro_axis + "\n";
  }
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
