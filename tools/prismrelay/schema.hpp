// SPDX-License-Identifier: MIT
// The tables of the database, as SQL.
#pragma once

#include <cstdint>
#include <string>

namespace prism::prismrelay {

inline constexpr int kSchemaVersion = 1;

/// The SQL of `prismrelay --init`, one transaction. Creates only what is missing.
std::string schema_sql();

/// The same tables, indexes and views in the session's temporary schema, without BEGIN and COMMIT.
std::string reference_sql();

/// Name of a day's partition (days since 1970 UTC), e.g. "rows_20261123", and the statement that creates it if it does
/// not exist.
std::string partition_name(std::int64_t day);
std::string partition_sql(std::int64_t day);

}  // namespace prism::prismrelay
