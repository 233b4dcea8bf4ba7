// SPDX-License-Identifier: MIT
// Accepted models, bound to their serial numbers, as a folder to be installed with a manifest.
#pragma once

#include "tools/prismcal/campaign/task_result.hpp"

namespace prism::campaign {

struct InstalledModels {
  std::size_t models = 0, kept = 0;  ///< of this campaign, and of others that stood there before
};

/// Makes `folder` hold the chosen model of every gyro as SERIAL.json or SERIAL-AXIS.json, and manifest.json: of each
/// its SHA-256, the measured values, the limits, the name in "asked_by", versions. Written to a new folder and
/// exchanged with the old one in one step: a reader sees all of the old or all of the new. `keep_others`: models of
/// gyros that are not chosen stay. Errors: a model that is not the one that was evaluated or not of its gyro, two gyros
/// of one file name, a folder of something else, a file system that cannot exchange folders.
Result<InstalledModels> install_models(const CampaignFile& file, const ResultStore& store, const Lot& lot,
                                       const std::string& folder, bool keep_others);

}  // namespace prism::campaign
