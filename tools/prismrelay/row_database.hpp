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
#include "tools/prismrelay/divided_commit.hpp"
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

  /// Commits the batch in one transaction, or in several if the server refuses some of its data (divided_commit.hpp).
  /// Returns the refusal of each item. After an error the batch is not stored, or a part of it; connect() reads the
  /// cursors that are stored.
  Result<std::vector<Refusal>> commit(const Batch& batch);

  /// Checks the connection.
  Result<void> ping();

  /// Creates the partitions of today and the next two days; drops those older than keep_days. Returns a line for each
  /// dropped partition.
  Result<std::vector<std::string>> keep_days();

 private:
  /// Calls progress and returns now + kTimeout.
  Postgres::Deadline next_deadline() const;
  Result<void> make_partitions(const std::set<std::int64_t>& days);
  Result<void> read_days();
  Result<void> transact(const CopyTexts& texts);
  /// transact(); the reason if the server refused the data.
  Result<std::optional<std::string>> try_to_store(const Batch& batch, const CopyTexts& texts);

  const PostgresSettings settings_;
  const std::string site_;
  const std::function<void()> progress_;
  std::optional<Postgres> connection_;
  std::map<LogKey, std::string> cursors_;  ///< of the site
  std::set<std::int64_t> days_;            ///< with a partition
  bool days_are_new_ = false;              ///< read since the commit began
};

}  // namespace prism::prismrelay
