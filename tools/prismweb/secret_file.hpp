// SPDX-License-Identifier: MIT
// Files with secrets, with access for this user only.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace prism::prismweb {

/// Reads at most 64 KiB of a file that write_private_file() wrote. Returns nullopt unless it is a regular file of this
/// user with mode 0600 and without further hard links.
std::optional<std::string> read_private_file(const std::string& path);

/// Replaces `path` by a new file of mode 0600. Never writes to an existing file or through a link.
Result<void> write_private_file(const std::string& path, std::string_view text);

}  // namespace prism::prismweb
