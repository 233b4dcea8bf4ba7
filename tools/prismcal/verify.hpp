// SPDX-License-Identifier: MIT
// Checks logs and captures: intact, truncated, changed, damaged, duplicate, missing or unreadable.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace prism::verification {

/// Checks log segments (formats 1 and 2) and captures, or all of them in folders and below, with the readers of the
/// other tools. Never fails: an unreadable file is a finding. Returns what --json prints: "faults", a number;
/// "findings" of files, or of a folder's log: path, state (prismcal(1), VERIFYING), text, line (from 1; none: the whole
/// file), fault; "sessions" of logs: log, axis (null: the only one), ends of the first and last second (first_s,
/// last_s; since 1970 or the device's epoch), rows, partial, missing_s, missing_frames, and holes: ends of the first
/// and last of consecutive seconds without a row. These are not faults: they come from the line or the machine.
nlohmann::ordered_json verify(const std::vector<std::string>& paths);

}  // namespace prism::verification
