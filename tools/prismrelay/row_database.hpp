// SPDX-License-Identifier: MIT
// Rows in PostgreSQL: each once, with how far its log has come in the same transaction.
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
  /// Longest that an attempt may last: then the connection is given up, and what was committed is asked for.
  static constexpr std::chrono::seconds kTimeout{20};

  /// `progress` is called before each thing that may last as long.
  RowDatabase(const PostgresSettings& settings, std::string site, std::function<void()> progress);

  bool connected() const { return connection_.has_value(); }
  /// Connects, looks at the schema's version, and reads how far each log of the site has come. Refused: the server, or
  /// the schema, in one line.
  Result<void> connect();
  /// The cursor to go on behind, as the ledger has it; empty: nothing of this log is there yet.
  std::string place(const LogKey& log) const;

  /// One transaction. Refused: nothing of it is there, or, where the connection was cut, all of it may be: connect()
  /// tells.
  Result<void> commit(const Batch& batch);

  /// Whether the server is there.
  Result<void> ping();

  /// Makes the partitions of today, tomorrow and the day after; drops those beyond keep_days. What was dropped, a line
  /// each.
  Result<std::vector<std::string>> keep_days();

 private:
  Postgres::Deadline soon() const;
  Result<void> make_partitions(const std::set<std::int64_t>& days);
  Result<void> transact(const Batch& batch);

  const PostgresSettings settings_;
  const std::string site_;
  const std::function<void()> progress_;
  std::optional<Postgres> connection_;
  std::map<LogKey, std::string> cursors_;  ///< of the site
  std::set<std::int64_t> days_;            ///< that have a partition
};

/// `prismrelay --init`: the schema, where there is none. What was done, in a line.
Result<std::string> init_schema(const PostgresSettings& settings);

}  // namespace prism::prismrelay
