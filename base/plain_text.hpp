// SPDX-License-Identifier: MIT
// Text helpers for messages: external text in one line, suggestions for mistyped names, counts with plurals.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace prism {

/// `text` with every byte outside 0x20 to 0x7e shown as '?', cut at `most` characters ("..." marks the cut).
std::string plain_text(std::string_view text, std::size_t most = 40);

/// The one of `names` closest to a mistyped `name`: a third of its letters (at least one) changed, omitted, added or
/// swapped with a neighbour, or one is a prefix of the other. Empty if no name is that close.
std::string nearest_name(std::string_view name, std::span<const std::string> names);

/// "1 row", "2 rows": `one` is the singular.
std::string counted(std::size_t count, std::string_view one);

}  // namespace prism
