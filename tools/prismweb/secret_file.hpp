// SPDX-License-Identifier: MIT
// Files with secrets: read only if other users cannot read them, written for this user alone.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace prism::prismweb {

/// Text of a file of secrets that a person made (passwords, TLS key). Errors: as read_text_file(), or users other than
/// owner and group may access it: "PATH: others may read it, expected mode 0640 or stricter".
Result<std::string> read_secret_file(const std::string& path);

/// Text of a file that write_private_file() made, at most 64 KiB. Returns nullopt if there is none, or if it is not a
/// regular file of mode 0600 that belongs to this user under this one name.
std::optional<std::string> read_private_file(const std::string& path);

/// Replaces `path` by a new file of mode 0600. A file or link of another user at this place is never written to.
Result<void> write_private_file(const std::string& path, std::string_view text);

}  // namespace prism::prismweb
