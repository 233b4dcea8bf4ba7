// SPDX-License-Identifier: MIT
// Installs the accepted models of a lot into a folder with a manifest.
#pragma once

#include "tools/prismcal/campaign/lot.hpp"

namespace prism::campaign {

struct InstalledModels {
  std::size_t models = 0;  ///< from this lot
  std::size_t kept = 0;    ///< models of other gyros that were in the folder before
};

/// Writes the chosen model of each gyro to `folder` as SERIAL.json or SERIAL-AXIS.json, and manifest.json with the
/// SHA-256, measured values, limits, "asked_by" and versions. Prepares a new folder and exchanges it atomically, so
/// that readers see either all old or all new files. `keep_others`: keeps the models of gyros that are not chosen.
/// Errors: a model is not the evaluated one or belongs to another gyro, two gyros have the same file name, `folder` has
/// files but no manifest, or the file system cannot exchange folders.
Result<InstalledModels> install_models(const LotFile& file, const ResultStore& store, const Lot& lot,
                                       const std::string& folder, bool keep_others);

}  // namespace prism::campaign
