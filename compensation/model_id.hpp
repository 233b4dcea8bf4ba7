// SPDX-License-Identifier: MIT
// The identity of a model: SHA-256 over its numbers, so that a model has the same id wherever it was written.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "compensation/model.hpp"

namespace prism::compensation {

inline constexpr int kModelVersion = 1;
inline constexpr std::array kSlopeNames = {"difference", "least_squares"};  ///< in the order of SlopeMethod

/// Canonical id: version, model type, features, inputs, domain and the numbers of the type (`content`, exact).
/// Names, the serial number and provenance are not included.
std::string model_id(const ModelInfo& info, std::string_view content);

/// The shortest text (at most 17 digits) that reads back as the same double.
std::string exact_text(double value);
std::string exact_texts(std::span<const double> values);

}  // namespace prism::compensation
