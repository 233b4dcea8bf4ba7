// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/table_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/plain_text.hpp"
#include "tools/prismcal/tables/containers.hpp"

namespace prism::tables {

Result<std::size_t> TableSource::find(const std::string& wanted) const {
  for (const bool with_unit : {true, false}) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if ((with_unit ? columns_[i].text : columns_[i].name) == wanted) return i;
    }
  }
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (std::to_string(i + 1) == wanted) return i;
  }
  return make_error(path_, fmt::format("found no column \"{}\", expected a number from 1 to {} or one of {}", wanted,
                                       columns_.size(), names_text()));
}

std::optional<std::size_t> TableSource::time_column() const {
  const auto first = [&](auto is) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (is(i)) return i;
    }
    return std::nullopt;
  };
  if (const auto by_unit = first([&](std::size_t i) {
        return columns_[i].unit && columns_[i].unit->quantity == "time" && kind(i) == ColumnKind::kNumber;
      }))
    return by_unit;
  if (const auto by_cells = first([&](std::size_t i) { return kind(i) == ColumnKind::kTime; })) return by_cells;
  return first([&](std::size_t i) { return is_named_time(i) && !columns_[i].unit && kind(i) == ColumnKind::kNumber; });
}

bool TableSource::is_named_time(std::size_t column) const {
  std::string name = columns_[column].name;
  for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  constexpr std::array<std::string_view, 8> kWords = {"time", "zeit",  "stamp", "x_value",
                                                      "date", "datum", "week",  "datenum"};
  return name == "t" || name.ends_with(".t") || std::any_of(kWords.begin(), kWords.end(), [&](std::string_view word) {
           return name.find(word) != std::string::npos;
         });
}

std::string TableSource::names_text() const {
  std::string text;
  for (const Header& column : columns_) text += (text.empty() ? "" : ", ") + column.text;
  return text;
}

std::string TableSource::understood() const {
  std::string text = fmt::format("{}: {}, {}", path_, dialect_text(), counted(columns_.size(), "column"));
  if (time_ && selection_.time)
    text += fmt::format("; time {}: {}", columns_[selection_.time->column].text, time_->text);
  if (!selection_.numbers.empty()) {
    text += "; read";
    for (std::size_t i = 0; i < selection_.numbers.size(); ++i) {
      const Header& column = columns_[selection_.numbers[i]];
      text += fmt::format("{}{}", i > 0 ? ", " : " ", column.text);
      if (i < counts_.holes.size() && counts_.holes[i] > 0)
        text += fmt::format(" ({})", counted(counts_.holes[i], "hole"));
    }
  }
  for (std::size_t i = 0; selection_.time && i < columns_.size(); ++i) {
    const Header& column = columns_[i];
    const bool is_read = i == selection_.time->column || (time_ && time_->second == i) ||
                         std::find(selection_.numbers.begin(), selection_.numbers.end(), i) != selection_.numbers.end();
    if (!is_read && column.stated && column.unit && column.unit->quantity == "time" && kind(i) == ColumnKind::kNumber)
      text += fmt::format("; not read: {}, a second time", column.text);
  }
  text += "; " + counted(counts_.rows, "row");
  if (counts_.torn > 0) text += fmt::format(", {} without a line end left out", counted(counts_.torn, "last row"));
  return text;
}

Result<std::unique_ptr<TableSource>> open_table(const std::string& path, const TableOptions& options) {
  const auto container = container_of(path);
  if (!container) return tl::unexpected<Error>(container.error());
  if (!container->refusal.empty()) {
    std::string refusal = container->refusal;
    if (const std::size_t at = refusal.find("FILE"); at != std::string::npos) refusal.replace(at, 4, path);
    return make_error(path, refusal);
  }
  if (container->is_mat) return open_mat(path, options);
  return open_text_table(path, options);
}

}  // namespace prism::tables
