// SPDX-License-Identifier: MIT
// The token, where this user's own programs find it.
#pragma once

#include <string>

#include "base/result.hpp"

namespace prism::prismweb {

/// Writes `token` to a file of mode 0600, `prismweb-PORT.token` in the runtime folder: $RUNTIME_DIRECTORY (systemd),
/// else $XDG_RUNTIME_DIR, else /tmp. Returns its path.
Result<std::string> write_token(const std::string& token, int port);

/// The token that a prismweb of before left there, so that pages that are open go on after a restart; empty where there
/// is none, or where the file is not this user's alone.
std::string kept_token(int port);

}  // namespace prism::prismweb
