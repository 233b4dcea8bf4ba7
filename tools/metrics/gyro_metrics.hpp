// SPDX-License-Identifier: MIT
// What one prismd says of itself, as metrics.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/metrics/exposition.hpp"

namespace prism::metrics {

/// The answers of a prismd (docs/protocol.md); null: not asked, or not answered.
struct GyroAnswers {
  nlohmann::json status, line, stability;
};

/// `gyro` becomes the label of the same name. Without a status there is prism_up 0 and nothing else: what was true is
/// not told. What is null in an answer has no sample.
void add_gyro(Exposition& exposition, const std::string& gyro, const GyroAnswers& answers);

/// When the text was made, so that an old file tells itself.
void add_time(Exposition& exposition, double time_s);

}  // namespace prism::metrics
