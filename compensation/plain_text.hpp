// SPDX-License-Identifier: MIT
// Foreign text made fit for a refusal: one line of printable ASCII of bounded length.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace prism {

/// `text` with every byte outside 0x20 to 0x7e shown as '?', cut at `most` characters ("..." marks the cut).
std::string plain_text(std::string_view text, std::size_t most = 40);

}  // namespace prism
