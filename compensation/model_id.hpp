// SPDX-License-Identifier: MIT
// The identity of a model: SHA-256 over its numbers, so that a model has the same id wherever it was written.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "compensation/model.hpp"

namespace prism::compensation {

/// Version 2: the id depends on the serial number. Models for any gyro are written as version 1, which prism 0.2 reads.
inline constexpr int kModelVersion = 2;
inline constexpr std::array kSlopeNames = {"difference", "least_squares"};  ///< in the order of SlopeMethod

/// Version of the file of a model.
int model_version(const ModelInfo& info);

/// Canonical id: version, model type, features, inputs, domain, the numbers of the type (`content`, exact), the
/// serial number and its axis (see ModelInfo::id_has_serial). Names and provenance are not included.
std::string model_id(const ModelInfo& info, std::string_view content);

/// The shortest text (at most 17 digits) that reads back as the same double.
std::string exact_text(double value);
std::string exact_texts(std::span<const double> values);

}  // namespace prism::compensation
