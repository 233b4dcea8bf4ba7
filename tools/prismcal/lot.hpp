// SPDX-License-Identifier: MIT
// The results of a lot: each gyro with each model, its violated limits, the comparison of the gyros, the report,
// and the installation of accepted models.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/prismcal/document.hpp"
#include "tools/prismcal/lot_file.hpp"

namespace prism::campaign {

/// Returns the violated limits of `result`, one line each. A value that could not be measured violates its limit. An
/// evaluation on training data is also listed.
std::vector<std::string> find_violations(const Task& result, const LotLimits& limits);

/// For each gyro the result of the first accepted model in the order of `models`. Gyros without one are omitted.
std::map<std::string, const Task*> chosen(const Lot& lot, const std::vector<ModelChoice>& models);

/// Reads the plan in `folder` and its results so far. Errors: no plan, a result that cannot be read, or one of another
/// version.
Result<Lot> read_lot(const std::string& folder, const LotLimits& limits);

/// The lot by model, distributions with outliers, and every gyro with every model. `previous`: an earlier lot, for the
/// drift since then, or null. Links to tasks' pages are relative to FOLDER/report.
report::Report lot_report(const LotFile& file, const Lot& lot, const Lot* previous);

struct InstalledModels {
  std::size_t models = 0;  ///< from this lot
  std::size_t kept = 0;    ///< models of other gyros that were in the folder before
};

/// Writes the chosen model of each gyro to `folder` as SERIAL.json or SERIAL-AXIS.json, and manifest.json with their
/// SHA-256, results, limits and "asked_by". Prepares a new folder and exchanges it atomically, so that readers see
/// either all old or all new files. `keep_others`: keeps the models of gyros that are not chosen. Errors: a model is
/// not the evaluated one or belongs to another gyro, two gyros have the same file name, `folder` has files but no
/// manifest, or the file system cannot exchange folders.
Result<InstalledModels> install_models(const LotFile& file, const Lot& lot, const std::string& folder,
                                       bool keep_others);

}  // namespace prism::campaign
