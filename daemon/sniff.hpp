// SPDX-License-Identifier: MIT
// `prismd --sniff`: which shipped description, at which speed, fits an unknown line or a file of bytes.
#pragma once

#include <string>

namespace prism::daemon {

/// Listens only. A serial device is heard for a second at each line setting that a description names; a file is read
/// whole. Prints what fits, with counts. Returns 0 where something fits, 1 where nothing does or nothing could be read.
int run_sniff(const std::string& path);

/// `prismd --check` of a frame description or a model instead of a configuration: reads it, runs its test vectors and
/// prints one line. Returns 0, or 78 after one line to stderr; −1 where the file is neither.
int check_document(const std::string& path);

}  // namespace prism::daemon
