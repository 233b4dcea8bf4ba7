// SPDX-License-Identifier: MIT
// Files with the bytes of a line, which need a frame description.
#pragma once

#include <string>

#include "base/result.hpp"

namespace prism::recordings {

/// Returns true if the first bytes are those of pcap or pcapng.
bool is_capture(const std::string& path);

/// "capture", "bytes" (binary) or "log of sentences"; empty: probably a table. Reads the first bytes.
/// Errors: those of FileReader::open(); a damaged container (MATLAB); a text that shows bytes (has_sentences()).
Result<std::string> bytes_kind(const std::string& path);

}  // namespace prism::recordings
