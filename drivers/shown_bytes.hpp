// SPDX-License-Identifier: MIT
// Texts that show the bytes of a line (hex dumps, logs of terminal programs); prism-import writes the bytes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace prism::drivers {

/// The first bytes of a file, by which it is known.
constexpr std::size_t kFirstBytes = 4096;

/// More than one in 20 of the file's first bytes are control characters: no text.
bool is_binary(std::string_view first);

/// Returns true if most lines are sentences ("$…*HH") as a device sends them. Errors: `first` begins a hex dump, or a
/// log with stamps before the sentences; the text names the command that writes the bytes of `path`.
Result<bool> has_sentences(const std::string& path, std::string_view first);

}  // namespace prism::drivers
