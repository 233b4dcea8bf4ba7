// SPDX-License-Identifier: MIT
// Parses a campaign file (JSON): recordings, models, limits and output for a lot of gyros.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "tools/prismcal/analysis/limits.hpp"

namespace prism::campaign {

enum class Role { kTrain, kRepeat, kOther };
inline constexpr std::array kRoleNames{"train", "repeat", "other"};  ///< in the order of Role
inline const char* role_name(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

struct RecordingPattern {
  Role role = Role::kTrain;
  std::vector<std::string> patterns;  ///< absolute shell patterns of prismd's log files or folders
};

/// `words`: options of `prismcal train`: "--method=ir-lssvm", "--no-earth-rate".
struct ModelChoice {
  std::string name;
  std::vector<std::string> words;
};

/// Limit of one finding of the data-quality check (length, disturbed, noise, …), in the unit of that finding.
using FindingLimit = analysis::Limit;

struct CampaignLimits {
  bool warnings_pass = true;            ///< accepts training recordings with data-quality warnings
  std::vector<FindingLimit> findings;   ///< for every training recording
  std::vector<analysis::Limit> repeat;  ///< for every recording with role repeat
  std::vector<analysis::Limit> other;   ///< for every recording with role other
};

struct CampaignFile {
  std::string path;  ///< absolute
  std::string name, asked_by;
  std::vector<RecordingPattern> recordings;
  std::vector<ModelChoice> models;   ///< in the order of preference
  std::vector<std::string> judging;  ///< options of `prismcal evaluate`
  CampaignLimits limits;
  std::string folder;                 ///< output directory, absolute
  bool reports = true;                ///< writes a page for each task
  std::string previous;               ///< output directory of an earlier campaign, absolute; empty: none
  std::vector<std::string> warnings;  ///< one per key that has no effect any more
};

/// Allowed names of findings.
inline constexpr std::array kFindingNames{"temperature_span", "length", "explainable", "moved",
                                          "disturbed",        "noise",  "quantised"};

/// Paths in the file are relative to its directory. Options of models and judging are checked by Work::check, not here.
/// Errors, with the JSON pointer: an unknown or missing key, a value outside its range, no recording of role train or
/// repeat, no model.
Result<CampaignFile> parse_campaign(std::string_view text, const std::string& path);
Result<CampaignFile> load_campaign(const std::string& path);

}  // namespace prism::campaign
