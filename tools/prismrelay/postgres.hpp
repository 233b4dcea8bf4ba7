// SPDX-License-Identifier: MIT
// Connection to a PostgreSQL server; each operation has a deadline.
#pragma once

#include <libpq-fe.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::prismrelay {

class Postgres {
 public:
  struct Clear {
    void operator()(PGresult* result) const { PQclear(result); }
  };
  using QueryResult = std::unique_ptr<PGresult, Clear>;

  /// `connection`: libpq connection string. `password`: empty if not required; no error message contains it. `timeout`:
  /// of each operation.
  static Result<Postgres> open(const std::string& connection, const std::string& password,
                               std::chrono::seconds timeout);

  /// Runs one or more statements, or one with parameters, and returns the result of the last one. Errors: the server's
  /// message in one line.
  Result<QueryResult> run(const std::string& sql, const std::vector<std::string>& parameters = {});
  /// Runs statements of which one is COPY … FROM STDIN, with `lines`.
  Result<void> copy(const std::string& sql, std::string_view lines);

  /// SQLSTATE of the last failed operation, e.g. "22003"; empty if the server did not send one, e.g. because the
  /// connection was lost.
  const std::string& sqlstate() const { return sqlstate_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Finish {
    void operator()(PGconn* connection) const { PQfinish(connection); }
  };
  Postgres(PGconn* connection, std::chrono::seconds timeout) : connection_(connection), timeout_(timeout) {}
  bool wait(short events) const;
  Result<void> flush();
  Result<QueryResult> last_result();
  /// libpq's message, or `fallback` if it has none.
  tl::unexpected<Error> connection_error(std::string_view fallback = "connection lost") const;

  std::unique_ptr<PGconn, Finish> connection_;
  std::chrono::seconds timeout_;
  Clock::time_point until_ = Clock::now() + timeout_;  ///< end of this operation
  std::string sqlstate_;
};

/// Returns a field as text; empty if it is null.
std::string field(const Postgres::QueryResult& result, int row, int column);

}  // namespace prism::prismrelay
