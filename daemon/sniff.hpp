// SPDX-License-Identifier: MIT
// `prismd --sniff`: finds the description and line settings that fit an unknown line or a file of bytes.
#pragma once

#include <string>

namespace prism::daemon {

/// Tries `description` (a name or a path), or all installed descriptions if it is empty. Sends no bytes. Reads a serial
/// device for one second at each line setting that a description contains, HOST:PORT (TCP) for one second, or a
/// complete file (capture or raw bytes). Prints the descriptions that fit, with counts. Returns 0 if one fits, 1 if
/// none fits or on errors.
int run_sniff(const std::string& path, const std::string& description);

/// `prismd --check` of a frame description or a model: reads it, runs its test vectors and prints one line. Returns 0,
/// 78 after an error line on stderr, or −1 if the file is neither.
int check_document(const std::string& path);

}  // namespace prism::daemon
