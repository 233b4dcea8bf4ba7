// SPDX-License-Identifier: MIT
// Whether somebody still writes a segment of a log or a capture: prismd locks it (flock) as long as it does.
#pragma once

#include <string>

namespace prism::recordings {

/// False where it cannot be opened, too.
bool is_locked(const std::string& path);

}  // namespace prism::recordings
