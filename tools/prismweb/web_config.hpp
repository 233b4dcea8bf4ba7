// SPDX-License-Identifier: MIT
// Reads the configuration of prismweb from a JSON file (comments allowed). Unknown keys are errors.
#pragma once

#include <string>
#include <string_view>

#include "base/json_document.hpp"
#include "base/result.hpp"
#include "tools/prismweb/settings.hpp"

namespace prism::prismweb {

/// Parses "127.0.0.1:8467" or "[::1]:8467". Errors: other texts and addresses that are not
/// loopback, with an empty place; `settings` is then unchanged.
Result<void> parse_listen(std::string_view text, Settings& settings);

/// Sets the settings that `text` contains. Relative paths start at the directory of `path`. Errors name the file and
/// the key.
Result<void> parse_web_config(std::string_view text, const std::string& path, Settings& settings);
Result<void> load_web_config(const std::string& path, Settings& settings);
/// JSON Schema of the configuration.
Json web_config_schema();

}  // namespace prism::prismweb
