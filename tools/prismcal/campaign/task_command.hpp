// SPDX-License-Identifier: MIT
// Shell command of one task, for `--engine print` and Slurm jobs.
#pragma once

#include <string>

#include "tools/prismcal/campaign/campaign_file.hpp"

namespace prism::campaign {

/// Returns the command that runs task `id` on any machine with the files under the same paths. `program`: path of
/// prismcal.
std::string task_command(const CampaignFile& file, const std::string& program, const std::string& id);

}  // namespace prism::campaign
