// SPDX-License-Identifier: MIT
// Stores rows in PostgreSQL, each once: the cursor of the log is committed in the same transaction.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "tools/prismrelay/batch.hpp"
#include "tools/prismrelay/postgres.hpp"
#include "tools/prismrelay/settings.hpp"

namespace prism::prismrelay {

class RowDatabase {
 public:
  /// Longest duration of an operation. After it the connection is closed, and connect() reads what was committed.
  static constexpr std::chrono::seconds kTimeout{20};

  /// `progress` is called before each operation that may last kTimeout.
  RowDatabase(const PostgresSettings& settings, std::string site, std::function<void()> progress);

  bool connected() const { return connection_.has_value(); }
  /// Connects, checks the version of the schema, and reads the cursor of each log of the site. Errors: no connection,
  /// no schema or another version, in one line.
  Result<void> connect();
  /// The cursor after the last committed row; empty if the database has no row of this log.
  std::string stored_cursor(const LogKey& log) const;

  /// Commits the batch in one transaction. After an error the batch is not stored; if the connection was lost it may
  /// be, and connect() reads the cursors that are stored.
  Result<void> commit(const Batch& batch);

  /// Checks the connection.
  Result<void> ping();

  /// Creates the partitions of today and the next two days; drops those older than keep_days. Returns a line for each
  /// dropped partition.
  Result<std::vector<std::string>> keep_days();

 private:
  /// Calls progress and returns now + kTimeout.
  Postgres::Deadline next_deadline() const;
  Result<void> make_partitions(const std::set<std::int64_t>& days);
  Result<void> transact(const Batch& batch);

  const PostgresSettings settings_;
  const std::string site_;
  const std::function<void()> progress_;
  std::optional<Postgres> connection_;
  std::map<LogKey, std::string> cursors_;  ///< of the site
  std::set<std::int64_t> days_;            ///< with a partition
};

}  // namespace prism::prismrelay
