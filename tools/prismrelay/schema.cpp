// SPDX-License-Identifier: MIT
#include "tools/prismrelay/schema.hpp"

#include <fmt/format.h>

#include <string_view>

#include "base/text_number.hpp"
#include "tools/prismrelay/row_converter.hpp"
#include "tools/prismrelay/schema_sql.hpp"

namespace prism::prismrelay {
namespace {

// "2026-11-23"
std::string day_text(std::int64_t day) { return utc_text(day * 86400).substr(0, 10); }

}  // namespace

std::string schema_sql() {
  constexpr std::string_view kMark = "  LOG_COLUMNS\n";
  std::string sql = kSchemaSql;
  return sql.replace(sql.find(kMark), kMark.size(), RowConverter::table_columns());
}

std::string reference_sql() {
  std::string sql = schema_sql();
  for (const std::string_view line : {"BEGIN;\n", "CREATE SCHEMA IF NOT EXISTS prism;\n", "COMMIT;\n"})
    sql.erase(sql.find(line), line.size());
  constexpr std::string_view kPrefix = "prism.", kTemporary = "pg_temp.";
  for (std::size_t at = 0; (at = sql.find(kPrefix, at)) != std::string::npos; at += kTemporary.size())
    sql.replace(at, kPrefix.size(), kTemporary);
  return sql;
}

std::string partition_name(std::int64_t day) {
  std::string name = day_text(day);
  std::erase(name, '-');
  return "rows_" + name;
}

std::string partition_sql(std::int64_t day) {
  return fmt::format(
      "CREATE TABLE IF NOT EXISTS prism.{} PARTITION OF prism.rows FOR VALUES FROM ('{} 00:00:00+00') TO ('{} "
      "00:00:00+00')",
      partition_name(day), day_text(day), day_text(day + 1));
}

}  // namespace prism::prismrelay
