// SPDX-License-Identifier: MIT
// Numbers as text on the hot path: fixed decimals, no locale, no allocation beyond the string's own.
#pragma once

#include <cstdint>
#include <string>

namespace prism {

/// Appends `value` rounded to `decimals` (0 to 9) places; halves away from zero. A value that is not finite appends
/// nothing: callers write what stands for "unknown" in their format. Beyond ±9e8 it falls back to shortest digits.
void append_fixed(std::string& text, double value, int decimals);

void append_integer(std::string& text, std::int64_t value);

/// 2026-11-21T09:11:00Z for whole seconds since 1970 UTC (years 0000 to 9999; beyond them the number itself).
std::string utc_text(std::int64_t second);

/// The same instant as utc_text in a form for file names: 20261121T091100Z.
std::string utc_file_text(std::int64_t second);

}  // namespace prism
