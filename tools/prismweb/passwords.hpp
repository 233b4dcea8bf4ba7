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

/// Lines NAME:HASH; empty ones and those that begin with '#' are passed over. Refused: another form, another hash than
/// bcrypt, a name twice, no name at all.
Result<PasswordHashes> parse_passwords(std::string_view text, const std::string& path);
/// Reads them; refused where others than owner and group may read the file.
Result<PasswordHashes> load_passwords(const std::string& path);

/// Whether `password` is that of the hash. Takes tenths of a second, by purpose. For a name that is not known, compare
/// with any hash: the time does not tell.
bool is_password(const std::string& password, const std::string& hash);
/// Refused where the password is empty or longer than the 72 bytes that bcrypt looks at.
Result<std::string> hash_password(const std::string& password);

/// Name and password of an Authorization field "Basic …"; nothing where it is another.
std::optional<std::pair<std::string, std::string>> basic_of(std::string_view authorization);

}  // namespace prism::prismweb
