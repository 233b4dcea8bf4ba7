// SPDX-License-Identifier: MIT
// One task as a line for a shell: what `--engine print` prints and what a Slurm job runs.
#pragma once

#include <string>

#include "tools/prismcal/campaign/campaign_file.hpp"

namespace prism::campaign {

/// One word for a shell, whatever it contains.
std::string shell_quoted(const std::string& text);

/// The command that runs task `id`, on any machine that has the files under the same paths. `program`: path of
/// prismcal.
std::string task_command(const CampaignFile& file, const std::string& program, const std::string& id);

}  // namespace prism::campaign
