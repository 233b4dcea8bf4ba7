// SPDX-License-Identifier: MIT
// Checks logs and captures: intact, truncated, changed, damaged, duplicate, missing or unreadable.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace prism::verification {

/// States before kTruncated are not faults.
enum class FileState {
  kIntact,      ///< unchanged since it was written
  kOpen,        ///< prismd still writes it (flock)
  kSuperseded,  ///< rows repeated in a later segment after a disk error
  kSkipped,     ///< not a file of prism
  kDeleted,     ///< segments before the oldest one of a log or capture
  kTruncated,   ///< no end, or an incomplete last row or packet: prismd was killed, power was lost, or it is a copy
  kChanged,  ///< log segment that differs from its end line (row count, SHA-256), or has damaged rows or bytes after it
  kDamaged,  ///< unreadable row, index, or part of a capture
  kDuplicate,   ///< row that repeats a second or goes back in its session; a file identical to another one
  kMissing,     ///< the log or capture had them: a file, or some of its rows
  kUnreadable,  ///< cannot be read, or has other contents than its name implies
};
/// Printed names; they do not change.
inline constexpr std::array kStateNames{"whole",   "open",    "superseded", "passed over",  // plain-ok: kept names
                                        "deleted", "torn",    "changed",    "damaged",
                                        "doubled", "missing", "refused"};

constexpr bool is_fault(FileState state) { return state >= FileState::kTruncated; }

/// One line about a file, or about a folder's log.
struct Finding {
  std::string path;
  FileState state = FileState::kIntact;
  std::string text;
  std::size_t line = 0;  ///< line, from 1; 0: entire file
};

/// Consecutive seconds of a session without a row: ends of the first and the last of them, s.
struct Gap {
  std::int64_t first_s = 0, last_s = 0;
};

/// One session of a log. Gaps are not faults of the file: they come from the line or the machine.
struct LogSession {
  std::string log = {};
  std::string axis = {};                 ///< empty if its folder has only one
  std::int64_t first_s = 0, last_s = 0;  ///< ends of its first and last second, s since 1970 or the device's epoch
  std::size_t rows = 0, partial = 0;
  std::uint64_t missing_frames = 0, missing_s = 0;
  std::vector<Gap> gaps = {};
};

struct VerificationResult {
  std::vector<Finding> findings;
  std::vector<LogSession> sessions;

  std::size_t faults() const;
};

/// Checks a log segment (formats 1 and 2) or a capture, or all of them in a folder and below. Uses the same readers as
/// the other tools. Never fails: an unreadable file is a finding.
VerificationResult verify(const std::string& path);

}  // namespace prism::verification
