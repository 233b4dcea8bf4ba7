// SPDX-License-Identifier: MIT
// Whole files: read, and written so that a reader sees the old one or the new one.
#pragma once

#include <string>
#include <string_view>

#include "base/result.hpp"

namespace prism {

/// A whole file's bytes; refused where it is a folder or cannot be read.
Result<std::string> read_text_file(const std::string& path);

/// Writes beside the target, waits for the disk (fsync), then renames: after a crash or on a full disk the old file is
/// whole. An existing file keeps its mode, a link its place. What is no file (a device, a pipe) is written straight.
Result<void> write_text_file(const std::string& path, std::string_view text);

}  // namespace prism
