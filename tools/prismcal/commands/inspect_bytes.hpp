// SPDX-License-Identifier: MIT
// `prismcal inspect` of a file that is not a table: the frame descriptions that fit its bytes.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "drivers/wire/decode/inspect.hpp"

namespace prism::commands {

/// The shipped and installed descriptions that fit the whole file, the best first. Errors: those of CaptureReader.
Result<std::vector<wire::SniffScore>> fitting_descriptions(const std::string& path);

}  // namespace prism::commands
