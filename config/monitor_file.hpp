// SPDX-License-Identifier: MIT
// The last verdicts of `prismcal monitor` on the models of an instance: a small file that prismd reads.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "config/config.hpp"

namespace prism::config {

struct ModelVerdict {
  std::string verdict;    ///< holds, drifted, too_little or failed
  std::string text;       ///< one sentence
  std::string model;      ///< id
  std::int64_t at_s = 0;  ///< host time
};

using ModelVerdicts = std::map<std::string, ModelVerdict>;  ///< by axis
inline constexpr const char* kOnlyAxis = "-";               ///< of a configuration without axes

/// monitor.json in $STATE_DIRECTORY (set by systemd), else in the directory of the log; empty without a log.
std::string monitor_file(const Config& config);
/// Empty if the file is absent or not of prismcal.
ModelVerdicts read_verdicts(const std::string& path);
Result<void> write_verdicts(const std::string& path, const ModelVerdicts& verdicts);

}  // namespace prism::config
