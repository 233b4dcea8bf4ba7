// SPDX-License-Identifier: MIT
// Compensated rows as text: the CSV of the log (and back), and the JSON of the socket.
#pragma once

#include <string>
#include <string_view>

#include "compensation/compensated.hpp"
#include "compensation/result.hpp"

namespace prism::compensation {

/// The column line of the log, without its line end.
std::string_view csv_columns();

/// One row, with its line end. Unknown quantities are empty fields. Decimals: rates and U 6, temperatures 5, slope 8.
void append_csv(std::string& text, const CompensatedWindow& row);

/// Reads one row back (line end optional); what the columns do not carry stays at its default. `where` names the line.
Result<CompensatedWindow> parse_csv(std::string_view line, std::string_view where);

/// What put_json needs at most.
inline constexpr std::size_t kJsonChars = 1024;

/// The "params" of a sample notification: {"time_s":…,"rate_deg_per_h":…,…}. Unknown quantities are null. Writes at
/// `at`, which has room for kJsonChars, and returns the end of what was written.
char* put_json(char* at, const Compensated& row);
/// The same, appended.
void append_json(std::string& text, const Compensated& row);
/// The "params" of a window notification.
void append_json(std::string& text, const CompensatedWindow& row);

}  // namespace prism::compensation
