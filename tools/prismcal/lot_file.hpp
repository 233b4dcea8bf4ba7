// SPDX-License-Identifier: MIT
// The file of a lot of gyros (JSON): recordings, models, limits and output.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "config/version.hpp"
#include "tools/prismcal/limits.hpp"

namespace prism::campaign {

enum class Role { kTrain, kRepeat, kOther };
inline constexpr std::array kRoleNames{"train", "repeat", "other"};  ///< in the order of Role
inline const char* role_name(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

struct RecordingPattern {
  Role role = Role::kTrain;
  std::vector<std::string> patterns;  ///< absolute shell patterns of logs, folders of logs, or tables
  /// Serial number of their gyro; "*": the text that the first * of the pattern matches; empty: that in the log.
  std::string serial;
};

/// `words`: options of `prismcal train`: "--method=ir-lssvm", "--no-earth-rate".
struct ModelChoice {
  std::string name;
  std::vector<std::string> words;
};

struct LotLimits {
  bool warnings_pass = true;             ///< accepts training recordings with data-quality warnings
  std::vector<analysis::Limit> quality;  ///< for every training recording, of the findings of the data-quality check
  std::vector<analysis::Limit> repeat;   ///< for every recording with role repeat
  std::vector<analysis::Limit> other;    ///< for every recording with role other
  nlohmann::ordered_json stated = nlohmann::ordered_json::object();  ///< as in the file
};

struct LotFile {
  std::string path;  ///< absolute
  std::string name, asked_by;
  std::vector<RecordingPattern> recordings;
  std::vector<ModelChoice> models;   ///< in the order of preference
  std::vector<std::string> judging;  ///< options of `prismcal evaluate`
  LotLimits limits;
  std::string folder;                 ///< output directory, absolute
  bool reports = true;                ///< writes a page for each task
  std::string previous;               ///< output directory of an earlier lot, absolute; empty: none
  std::string version = kVersion;     ///< of this program
  std::vector<std::string> warnings;  ///< one per key that has no effect any more
};

/// Paths in the file are relative to its directory. Does not check the options of models and judging. Errors, with the
/// JSON pointer: an unknown or missing key, a value outside its range, no recording of role train or repeat, no model,
/// a serial number "*" that a pattern does not determine.
Result<LotFile> parse_lot_file(std::string_view text, const std::string& path);
Result<LotFile> load_lot_file(const std::string& path);

/// The text that the first * of a pattern matched in a path: the pattern has no wildcard before it, and no other one in
/// the same folder or file name, which parse_lot_file() checks.
std::string matched_by_star(const std::string& pattern, const std::string& path);

}  // namespace prism::campaign
