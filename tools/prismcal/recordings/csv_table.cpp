// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/outside_text.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::recordings {

Result<CsvTable> CsvTable::read(const std::string& path) {
  const auto sum = sha256_of_file(path);
  if (!sum) return tl::unexpected<Error>(sum.error());
  CsvTable table;
  table.path_ = path;
  table.sha256_ = *sum;
  auto opened = CsvLines::open(path);
  if (!opened) return tl::unexpected<Error>(opened.error());
  CsvLines& lines = *opened;
  if (lines.next()) {
    table.header_ = lines.line();
    table.separator_ = lines.separator();
    for (std::string& name : lines.fields()) {
      if (auto good = check_text(TextRule::kText, name, lines.position()); !good)
        return tl::unexpected<Error>(good.error());
      if (std::find(table.names_.begin(), table.names_.end(), name) != table.names_.end())
        return make_error(lines.position(), fmt::format("found column \"{}\" twice", name));
      table.names_.push_back(std::move(name));
    }
  }
  while (lines.next()) {
    if (const std::size_t found = lines.field_count(); found != table.names_.size())
      return make_error(lines.position(), fmt::format("found {} fields, expected {}", found, table.names_.size()));
    table.lines_.push_back({lines.line(), lines.number()});
  }
  if (auto good = lines.finish(); !good) return tl::unexpected<Error>(good.error());
  if (table.lines_.empty()) return make_error(path, "found no row below a line of names");
  return table;
}

Result<std::vector<double>> CsvTable::column(const std::string& name) const {
  const auto index = csv_column(names_, name);
  if (!index)
    return make_error(path_, fmt::format("found no column \"{}\", expected a number from 1 to {} or one of {}", name,
                                         names_.size(), fmt::join(names_, ", ")));
  std::vector<double> values;
  values.reserve(lines_.size());
  for (const NumberedLine& line : lines_) {
    const std::string_view field = *csv_field(line.text, separator_, *index);
    const auto value = csv_number(field);
    if (!value) {
      return make_error(fmt::format("{}:{}", path_, line.number),
                        fmt::format("column {}: found \"{}\", expected a finite number", name, field));
    }
    values.push_back(*value);
  }
  return values;
}

Result<Eigen::MatrixXd> CsvTable::columns(const std::vector<std::string>& names) const {
  Eigen::MatrixXd matrix(names.size(), lines_.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto values = column(names[i]);
    if (!values) return tl::unexpected<Error>(values.error());
    matrix.row(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::RowVectorXd>(values->data(), static_cast<Eigen::Index>(values->size()));
  }
  return matrix;
}

}  // namespace prism::recordings
