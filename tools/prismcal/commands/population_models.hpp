// SPDX-License-Identifier: MIT
// Reads models of gyros of the same type for `prismcal train --prior FOLDER`.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/model.hpp"

namespace prism::commands {

/// Reads all *.json of `folder`, sorted by name, except models of gyro `own_serial` (if not empty). Errors: an
/// unreadable folder, a file that is not a model, fewer than two models left.
Result<std::vector<compensation::ModelPtr>> read_population_models(const std::string& folder,
                                                                   const std::string& own_serial);

}  // namespace prism::commands
