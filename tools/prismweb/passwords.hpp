// SPDX-License-Identifier: MIT
// Names and passwords of those who may look, for addresses that others reach.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.hpp"

namespace prism::prismweb {

/// Hashes by name: bcrypt ("$2b$…", also as htpasswd -B writes it) by libcrypt.
using PasswordHashes = std::map<std::string, std::string>;

/// Parses lines NAME:HASH; skips empty lines and lines that begin with '#'. Errors: another form, a hash that is not
/// bcrypt of cost 4 to 15 or that no password can have, a name twice, no name at all.
Result<PasswordHashes> parse_passwords(std::string_view text, const std::string& path);
/// Reads the file. Errors: as read_secret_file() and parse_passwords().
Result<PasswordHashes> load_passwords(const std::string& path);

/// True if the hash is of `password`. Takes tenths of a second, on purpose. For an unknown name compare with any hash,
/// so that the time does not show it. False for a password of more than 72 bytes or with a NUL byte.
bool is_password(const std::string& password, const std::string& hash);
/// Errors: the password is empty, longer than the 72 bytes that bcrypt reads, or contains a NUL byte.
Result<std::string> hash_password(const std::string& password);

/// Name and password of an Authorization field "Basic …"; nothing where it is another.
std::optional<std::pair<std::string, std::string>> basic_of(std::string_view authorization);

}  // namespace prism::prismweb
