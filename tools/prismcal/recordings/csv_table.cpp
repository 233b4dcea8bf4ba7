// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "compensation/sha256.hpp"
#include "config/text_file.hpp"

namespace prism::recordings {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '"' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view field(std::string_view line, char separator, std::size_t index) {
  for (std::size_t begin = 0;; ++begin) {
    const std::size_t end = std::min(line.find(separator, begin), line.size());
    if (index-- == 0) return trimmed(line.substr(begin, end - begin));
    begin = end;
  }
}

std::size_t count_fields(std::string_view line, char separator) {
  return static_cast<std::size_t>(std::count(line.begin(), line.end(), separator)) + 1;
}

bool parse_number(std::string_view text, double& value) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace

Result<CsvTable> CsvTable::read(const std::string& path) {
  auto text = config::read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse(std::move(*text), path);
}

Result<CsvTable> CsvTable::parse(std::string text, const std::string& where) {
  CsvTable table;
  table.where_ = where;
  // A short string lives inside its object and would move away from its views; longer ones keep their place.
  table.text_ = std::move(text);
  table.text_.reserve(64);
  table.sha256_ = sha256_hex(table.text_);
  const std::string_view all = table.text_;
  std::size_t number = 0;
  for (std::size_t begin = all.rfind("\xEF\xBB\xBF", 0) == 0 ? 3 : 0; begin < all.size();) {
    const std::size_t end = std::min(all.find('\n', begin), all.size());
    std::string_view line = all.substr(begin, end - begin);
    begin = end + 1;
    ++number;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    if (table.names_.empty()) {
      table.header_ = line;
      for (const char separator : {',', ';', '\t'}) {
        if (line.find(separator) == std::string_view::npos) continue;
        table.separator_ = separator;
        break;
      }
      for (std::size_t i = 0; i < count_fields(line, table.separator_); ++i) {
        const std::string name(field(line, table.separator_, i));
        if (table.has(name))
          return refuse(fmt::format("{}:{}", where, number), fmt::format("the column \"{}\" is named twice", name));
        table.names_.push_back(name);
      }
      continue;
    }
    if (const std::size_t found = count_fields(line, table.separator_); found != table.names_.size()) {
      return refuse(fmt::format("{}:{}", where, number),
                    fmt::format("found {} fields, expected {}", found, table.names_.size()));
    }
    table.lines_.push_back({line, number});
  }
  if (table.names_.empty() || table.lines_.empty()) return refuse(where, "found no row below a line of names");
  return table;
}

bool CsvTable::has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

Result<std::vector<double>> CsvTable::column(const std::string& name) const {
  const auto at = std::find(names_.begin(), names_.end(), name);
  if (at == names_.end())
    return refuse(where_, fmt::format("found no column \"{}\", expected one of {}", name, fmt::join(names_, ", ")));
  const auto index = static_cast<std::size_t>(at - names_.begin());
  std::vector<double> values;
  values.reserve(lines_.size());
  for (const Line& line : lines_) {
    double value = 0;
    const std::string_view text = field(line.text, separator_, index);
    if (!parse_number(text, value)) {
      return refuse(fmt::format("{}:{}", where_, line.number),
                    fmt::format("column {}: found \"{}\", expected a finite number", name, text));
    }
    values.push_back(value);
  }
  return values;
}

Result<Eigen::MatrixXd> CsvTable::columns(const std::vector<std::string>& names) const {
  Eigen::MatrixXd matrix(names.size(), lines_.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto values = column(names[i]);
    if (!values) return tl::unexpected<Error>(values.error());
    for (std::size_t j = 0; j < values->size(); ++j)
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = (*values)[j];
  }
  return matrix;
}

std::vector<std::string> split_names(const std::string& text) {
  std::vector<std::string> names;
  for (std::size_t i = 0; !text.empty() && i < count_fields(text, ','); ++i) names.emplace_back(field(text, ',', i));
  return names;
}

}  // namespace prism::recordings
