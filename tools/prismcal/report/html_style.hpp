// SPDX-License-Identifier: MIT
// The look of the page, on screen and on paper.
#pragma once

namespace prism::report {

extern const char* const kStyle;

}  // namespace prism::report
