// SPDX-License-Identifier: MIT
// Opens the configured database, and creates its schema or completes it.
#pragma once

#include <string>

#include "base/result.hpp"
#include "tools/prismrelay/postgres.hpp"
#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// Connects with the password of the settings, if any.
Result<Postgres> open_database(const PostgresSettings& settings, Postgres::Deadline until);

/// Returns the version of the schema; −1 if it does not exist, 0 if its table has no row.
Result<int> schema_version(Postgres& connection, Postgres::Deadline until);
tl::unexpected<Error> schema_version_error(int found);

/// `prismrelay --init`: creates the schema, or the missing objects of one that exists; has no effect if it is
/// complete. One transaction; waits while another --init runs. Returns a line for the user. Errors: another version, or
/// an object that differs from the expected one.
Result<std::string> init_schema(const PostgresSettings& settings);

}  // namespace prism::prismrelay
