// SPDX-License-Identifier: MIT
// Detects whether prismd still writes a log segment or capture: it holds a lock (flock) on the file.
#pragma once

#include <string>

namespace prism::recordings {

/// Returns false also if the file cannot be opened.
bool is_locked(const std::string& path);

}  // namespace prism::recordings
