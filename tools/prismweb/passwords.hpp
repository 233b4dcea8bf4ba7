// SPDX-License-Identifier: MIT
// The password file: names and bcrypt hashes of the users of prismweb.
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
/// bcrypt of cost 4 to 15 or that matches no password, a duplicate name, no names.
Result<PasswordHashes> parse_passwords(std::string_view text, const std::string& path);
/// Reads the file. Errors: as read_secret_file() and parse_passwords().
Result<PasswordHashes> load_passwords(const std::string& path);

/// True if `hash` is a hash of `password`. Takes tenths of a second, by design of bcrypt. For an unknown name compare
/// with any hash, so that the time does not reveal it. False if the password has over 72 bytes or a NUL byte.
bool is_password(const std::string& password, const std::string& hash);
/// Returns a bcrypt hash. Errors: the password is empty, contains a NUL byte, or has over 72 bytes (bcrypt ignores the
/// rest).
Result<std::string> hash_password(const std::string& password);

/// Returns name and password of an Authorization field "Basic …"; nullopt for any other.
std::optional<std::pair<std::string, std::string>> basic_of(std::string_view authorization);

}  // namespace prism::prismweb
