// SPDX-License-Identifier: MIT
// Compares the schema of a database with schema.sql, object by object.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismrelay/postgres.hpp"

namespace prism::prismrelay {

/// Result of check_schema(). Extra objects and columns of the user are allowed.
struct SchemaCheck {
  std::vector<std::string> missing;      ///< "table places", "column rows.quality", "index rows_arrival"
  std::vector<std::string> statements;   ///< SQL for those that schema_sql() does not create: columns, primary keys
  bool is_empty = false;                 ///< no object exists
  std::vector<std::string> differences;  ///< what must be changed by hand, with what was found and expected
};

/// Creates the schema of schema_sql() in the session's temporary schema, as a reference, and compares. Call it once per
/// connection, within a transaction.
Result<SchemaCheck> check_schema(Postgres& connection, Postgres::Deadline until);

}  // namespace prism::prismrelay
