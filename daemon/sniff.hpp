// SPDX-License-Identifier: MIT
// `prismd --sniff`: which description, at which speed, fits an unknown line or a file of bytes.
#pragma once

#include <string>

namespace prism::daemon {

/// Tries `description`, a name or a path; every description that is found by name where it is empty. Listens only. A
/// serial device is heard for a second at each line setting that a description names; a file, a capture or bare bytes,
/// is read whole. Prints what fits, with counts. Returns 0 where something fits, 1 where nothing does or nothing could
/// be read.
int run_sniff(const std::string& path, const std::string& description);

/// `prismd --check` of a frame description or a model instead of a configuration: reads it, runs its test vectors and
/// prints one line. Returns 0, or 78 after one line to stderr; −1 where the file is neither.
int check_document(const std::string& path);

}  // namespace prism::daemon
