// SPDX-License-Identifier: MIT
// The database: its schema, and rows stored once each, because the cursor of the log is in the same transaction.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismrelay/batch.hpp"
#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

/// The SQL of `prismrelay --init` for a new database: all files of schema/, one transaction.
std::string schema_sql();

/// `prismrelay --init`: runs the files of schema/ above the version of the database, in one transaction. Waits while
/// another one runs. Returns a line for the user. Errors: a later version, or that of the server.
Result<std::string> init_schema(const PostgresSettings& settings);

/// A connection to the server. Each operation waits for the server. After an error, close it.
class Session;

/// Connects, checks the version of the schema, and returns the cursor after the last stored row of each log of the
/// site.
Result<std::map<LogKey, std::string>> connect(const PostgresSettings& settings, const std::string& site,
                                              std::shared_ptr<Session>& session);

/// Stores the batch, which may be empty, in one transaction. If the server refuses some of the data, repeats it row by
/// row with savepoints: refused rows are stored in refused_rows; what else is refused, and why, is in the items. After
/// an error nothing is stored, or all, if the response was lost.
Result<void> commit(Session& session, const Batch& batch);

/// Creates the partitions of today and the next two days; drops those older than `keep_days`. Returns a line for each
/// dropped partition.
Result<std::vector<std::string>> keep_partitions(Session& session, std::optional<int> keep_days);

}  // namespace prism::prismrelay
