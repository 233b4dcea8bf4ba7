// SPDX-License-Identifier: MIT
// The work for a lot of gyros, declared in one JSON file: recordings, models, limits, output.
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
  std::vector<std::string> patterns;  ///< as a shell's, absolute; of prismd's logs, files or folders
};

/// Options of `prismcal train` or `evaluate` as words: "--method=ir-lssvm", "--no-earth-rate".
struct ModelChoice {
  std::string name;
  std::vector<std::string> words;
};

/// Of one finding of the data-quality check (length, disturbed, noise, …), in its own unit.
using FindingLimit = analysis::Limit;

struct CampaignLimits {
  bool warnings_pass = true;            ///< a recording of which the data-quality check warns may train
  std::vector<FindingLimit> findings;   ///< of every recording that trains
  std::vector<analysis::Limit> repeat;  ///< of every recording of the role
  std::vector<analysis::Limit> other;
};

struct CampaignFile {
  std::string path;  ///< absolute
  std::string name, asked_by;
  std::vector<RecordingPattern> recordings;
  std::vector<ModelChoice> models;   ///< in the order of preference
  std::vector<std::string> judging;  ///< words of `prismcal evaluate`
  CampaignLimits limits;
  std::string level;     ///< "native", "x86-64-v4", "x86-64-v3", "baseline"
  std::string folder;    ///< of everything that is written, absolute
  bool reports = true;   ///< a page for every task
  std::string previous;  ///< folder of an earlier campaign, absolute; empty: none
  std::vector<std::string> slurm_options;
};

/// Names that a finding can have, and the instruction levels that can be asked for.
inline constexpr std::array kFindingNames{"temperature_span", "length", "explainable", "moved",
                                          "disturbed",        "noise",  "quantised"};
inline constexpr std::array kLevelNames{"native", "x86-64-v4", "x86-64-v3", "baseline"};

/// Strict: an unknown or missing key, a value out of its range, a campaign without a recording to train on or without a
/// model is refused with its place. Paths are relative to the file's folder. Options of models and judging are taken as
/// they are: Work::check checks them.
Result<CampaignFile> parse_campaign(std::string_view text, const std::string& path);
Result<CampaignFile> load_campaign(const std::string& path);

}  // namespace prism::campaign
