// SPDX-License-Identifier: MIT
// The configuration of prismweb, read strictly from one JSON file (comments allowed).
#pragma once

#include <string>
#include <string_view>

#include "base/result.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

/// "127.0.0.1:8467" or "[::1]:8467"; false, and nothing changed, where it is something else.
bool parse_listen(std::string_view text, Settings& settings);

/// Reads `text` over what `settings` has. Relative paths are relative to the folder of `path`. Refused with the place
/// in the file.
Result<void> parse_web_config(std::string_view text, const std::string& path, Settings& settings);
Result<void> load_web_config(const std::string& path, Settings& settings);

/// Refuses what would be open to others: an address that is not of this host alone, without TLS and passwords.
Result<void> check_settings(const Settings& settings);

}  // namespace prism::prismweb
