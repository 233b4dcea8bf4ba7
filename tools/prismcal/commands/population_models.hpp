// SPDX-License-Identifier: MIT
// The models of gyros of the same type, for `prismcal train --prior FOLDER`.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "compensation/model.hpp"

namespace prism::commands {

/// Every .json of the folder, by name, but the models bound to `own_serial` (where that is not empty). Refuses a folder
/// that cannot be read, one of its files that is no model, and fewer than two that are left.
Result<std::vector<compensation::ModelPtr>> read_population_models(const std::string& folder,
                                                                   const std::string& own_serial);

}  // namespace prism::commands
