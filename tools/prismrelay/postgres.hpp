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
  using Deadline = std::chrono::steady_clock::time_point;
  struct Clear {
    void operator()(PGresult* result) const { PQclear(result); }
  };
  using QueryResult = std::unique_ptr<PGresult, Clear>;

  /// `connection`: libpq connection string. `password`: empty if not required; no error message contains it.
  static Result<Postgres> open(const std::string& connection, const std::string& password, Deadline until);

  /// Runs one or more statements and returns the result of the last one. Errors: the server's message in one line.
  Result<QueryResult> run(const std::string& sql, Deadline until);
  /// Runs one statement with its parameters, as text.
  Result<QueryResult> run(const std::string& sql, const std::vector<std::string>& parameters, Deadline until);
  /// Runs COPY … FROM STDIN with `lines`.
  Result<void> copy(const std::string& sql, std::string_view lines, Deadline until);

  /// SQLSTATE of the last failed operation, e.g. "22003"; empty if the server did not send one, e.g. because the
  /// connection was lost.
  const std::string& sqlstate() const { return sqlstate_; }

  int socket() const { return PQsocket(connection_.get()); }

 private:
  struct Finish {
    void operator()(PGconn* connection) const { PQfinish(connection); }
  };
  explicit Postgres(PGconn* connection) : connection_(connection) {}
  Result<void> flush(Deadline until);
  Result<QueryResult> next_result(Deadline until);
  Result<QueryResult> last_result(Deadline until);
  /// libpq's message, or `fallback` if it has none.
  tl::unexpected<Error> connection_error(std::string_view fallback = "connection lost") const;

  std::unique_ptr<PGconn, Finish> connection_;
  std::string sqlstate_;
};

/// Returns a field as text; empty if it is null.
std::string field(const Postgres::QueryResult& result, int row, int column);

}  // namespace prism::prismrelay
