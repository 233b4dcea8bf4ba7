// SPDX-License-Identifier: MIT
// Checks which of prism's files are intact, torn, damaged, doubled or missing.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace prism::verification {

/// The first four are not faults.
enum class FileState {
  kIntact,      ///< as it was written
  kOpen,        ///< a living prismd writes it (flock)
  kSuperseded,  ///< rows repeated in a later segment after a disk error
  kSkipped,     ///< not a file of prism
  kTruncated,   ///< no end, or a part of a row or packet at its end: prismd or the machine was ended by force
  kChanged,     ///< its checksum is wrong: it was changed after writing
  kDamaged,     ///< a row, an index or a part of a capture that cannot be read
  kDuplicate,   ///< rows that stood before, or go back, in their session; a copy of another file
  kMissing,     ///< an index names it, or more of its rows than there are
  kUnreadable,  ///< cannot be read, or is not what its name says
};
inline constexpr std::array kStateNames{"whole",   "open",    "superseded", "passed over", "torn",
                                        "changed", "damaged", "doubled",    "missing",     "refused"};

constexpr bool is_fault(FileState state) { return state >= FileState::kTruncated; }

/// One line about a file, or about a folder's log.
struct Finding {
  std::string path;
  FileState state = FileState::kIntact;
  std::string text;
  std::size_t line = 0;  ///< of the file, from 1; 0: all of it
};

/// Seconds of a session that have no row: the ends of the first and of the last one, s.
struct Gap {
  std::int64_t first_s = 0, last_s = 0;
};

/// One session of a log. A hole is a fault of the line or of the machine, not of the file.
struct LogSession {
  std::string log;
  std::string axis;                      ///< empty if its folder has only one
  std::int64_t first_s = 0, last_s = 0;  ///< ends of its first and last second, s since 1970 or the device's epoch
  std::size_t rows = 0, partial = 0;
  std::uint64_t missing_frames = 0, missing_s = 0;
  std::vector<Gap> holes;
};

struct VerificationResult {
  std::vector<Finding> findings;
  std::vector<LogSession> sessions;

  std::size_t faults() const;
};

/// Of a log segment (formats 1 and 2), a capture, a model, a frame description or a configuration; of a folder, of
/// every one of them in it and below it. Read with the code that reads them elsewhere. Throws nothing and refuses
/// nothing: what cannot be read is a finding. A configuration is judged alone; `prismd --check` judges what it names,
/// too.
VerificationResult verify(const std::string& path);

}  // namespace prism::verification
