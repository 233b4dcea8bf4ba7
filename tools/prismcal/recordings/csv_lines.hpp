// SPDX-License-Identifier: MIT
// Fields of one line of prism's own files and of lists on the command line. Tables of other programs: ../tables.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace prism::recordings {

/// Returns field `index` of a line without surrounding blanks and quotes, or nullopt if the line has fewer fields.
std::optional<std::string_view> csv_field(std::string_view line, char separator, std::size_t index);
/// Returns all fields of a line. An empty line has none.
std::vector<std::string> csv_fields(std::string_view line, char separator);

}  // namespace prism::recordings
