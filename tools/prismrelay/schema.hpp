// SPDX-License-Identifier: MIT
// The ledger's tables, as SQL.
#pragma once

#include <cstdint>
#include <string>

namespace prism::prismrelay {

inline constexpr int kSchemaVersion = 1;

/// Everything that `prismrelay --init` applies, in one transaction.
std::string schema_sql();

/// The partition of a day (days since 1970 UTC): "rows_20261123", and the statement that makes it where it is not
/// there.
std::string partition_name(std::int64_t day);
std::string partition_sql(std::int64_t day);

}  // namespace prism::prismrelay
