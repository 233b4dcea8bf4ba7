// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/csv_table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace prism::recordings {

Result<CsvColumns> read_csv_columns(const std::string& path, const std::vector<std::string>& names,
                                    const tables::TableOptions& options, bool keep_text, const std::string& time) {
  auto table = tables::PlainTable::open(path, options);
  if (!table) return tl::unexpected<Error>(table.error());
  tables::Selection selection;
  selection.keep_text = keep_text;
  std::size_t time_place = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto index = table->find(names[i]);
    if (!index) return tl::unexpected<Error>(index.error());
    if (names[i] == time && !selection.time) {
      time_place = i;
      const bool has_unit = table->columns()[*index].unit || !options.time_unit.empty();
      selection.time = tables::TimeSelection{*index, has_unit ? "" : "s"};
    } else {
      selection.numbers.push_back(*index);
    }
  }
  if (auto good = table->select(selection); !good) return tl::unexpected<Error>(good.error());
  std::vector<double> values;
  CsvColumns columns;
  tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) return tl::unexpected<Error>(more.error());
    if (!*more) break;
    auto value = row.values.begin();
    auto column = selection.numbers.begin();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const tables::Header& header = table->columns()[i == time_place ? 0 : *column];
      if (i == time_place)
        values.push_back(static_cast<double>(row.time_ns) / 1e9);
      else if (++column; header.stated)
        values.push_back(*value++ * header.unit->factor + header.unit->offset);
      else
        values.push_back(*value++);
    }
    if (keep_text) columns.text.push_back(row.text);
  }
  columns.values = Eigen::Map<const Eigen::MatrixXd>(values.data(), static_cast<Eigen::Index>(names.size()),
                                                     static_cast<Eigen::Index>(table->rows()));
  columns.separator = table->separator();
  columns.decimal = table->decimal();
  for (const tables::Header& header : table->columns())
    columns.header += (columns.header.empty() ? "" : std::string(1, columns.separator)) + header.text;
  if (options.announce) options.announce(table->understood());
  return columns;
}

std::size_t CsvColumns::drop_holes() {
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    if (!values.col(i).allFinite()) continue;
    if (kept != i) {
      values.col(kept) = values.col(i);
      if (!text.empty()) text[static_cast<std::size_t>(kept)] = std::move(text[static_cast<std::size_t>(i)]);
    }
    ++kept;
  }
  const auto dropped = static_cast<std::size_t>(values.cols() - kept);
  values.conservativeResize(Eigen::NoChange, kept);
  if (!text.empty()) text.resize(static_cast<std::size_t>(kept));
  return dropped;
}

}  // namespace prism::recordings
