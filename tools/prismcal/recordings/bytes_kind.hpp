// SPDX-License-Identifier: MIT
// Files with the bytes of a line, which need a frame description.
#pragma once

#include <string>

#include "base/result.hpp"

namespace prism::recordings {

/// Returns true if the first bytes are those of pcap or pcapng.
bool is_capture(const std::string& path);

/// "capture", "bytes" (binary), "hex dump" or "log of sentences"; empty: probably a table. Reads the first 4096 bytes.
/// Errors: those of FileReader::open(); a damaged container (MATLAB).
Result<std::string> bytes_kind(const std::string& path);

}  // namespace prism::recordings
