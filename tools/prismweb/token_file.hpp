// SPDX-License-Identifier: MIT
// The token of a start, where this user's own programs find it.
#pragma once

#include <string>

#include "compensation/result.hpp"

namespace prism::prismweb {

/// Writes `token` to a file of mode 0600, `prismweb-PORT.token` in the runtime folder: $RUNTIME_DIRECTORY (systemd),
/// else $XDG_RUNTIME_DIR, else /tmp. Returns its path.
Result<std::string> write_token(const std::string& token, int port);

}  // namespace prism::prismweb
