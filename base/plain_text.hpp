// SPDX-License-Identifier: MIT
// Words for refusals and notes: foreign text made fit for one line, the name that was probably meant, things counted.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace prism {

/// `text` with every byte outside 0x20 to 0x7e shown as '?', cut at `most` characters ("..." marks the cut).
std::string plain_text(std::string_view text, std::size_t most = 40);

/// The one of `names` that a mistyped `name` probably stands for: a third of its letters (at least one) changed, left
/// out, added or swapped with a neighbour, or one the beginning of the other. Empty where none is so near.
std::string nearest_name(std::string_view name, std::span<const std::string> names);

/// "1 row", "2 rows": `one` is the word for one of them.
std::string counted(std::size_t count, std::string_view one);

}  // namespace prism
