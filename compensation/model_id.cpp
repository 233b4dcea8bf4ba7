// SPDX-License-Identifier: MIT
#include "compensation/model_id.hpp"

#include <fmt/format.h>

#include "compensation/sha256.hpp"

namespace prism {

std::string exact_text(double value) { return fmt::format("{}", value); }

std::string exact_texts(std::span<const double> values) { return fmt::format("[{}]", fmt::join(values, ", ")); }

std::string model_id(const ModelInfo& info, std::string_view content) {
  const FeatureDefinition& f = info.features;
  std::string canonical = fmt::format("prism-model {} {}\n{} {} {} {} {}\n{}\n{} {}\n", kModelVersion, info.kind, f.length_s,
                                      kSlopeNames[static_cast<std::size_t>(f.slope)], f.end_mean_s, f.max_gap_s,
                                      exact_texts(f.lag_time_constants_s), fmt::join(info.inputs, " "),
                                      exact_texts(info.domain.min), exact_texts(info.domain.max));
  return sha256_hex(canonical += content);
}

}  // namespace prism
