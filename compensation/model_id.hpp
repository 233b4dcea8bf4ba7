// SPDX-License-Identifier: MIT
// The identity of a model: SHA-256 over its numbers, so that the same model has the same id wherever it was written.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "compensation/model.hpp"

namespace prism::compensation {

inline constexpr int kModelVersion = 1;
inline constexpr std::array kSlopeNames = {"difference", "least_squares"};  ///< in the order of SlopeMethod

/// Canonical id: version, kind, features, inputs, domain and the kind's own numbers (`content`, exact).
/// Names, the serial number and provenance are not part of it.
std::string model_id(const ModelInfo& info, std::string_view content);

/// The fewest digits (at most 17) that read back as the very same double.
std::string exact_text(double value);
std::string exact_texts(std::span<const double> values);

}  // namespace prism::compensation
