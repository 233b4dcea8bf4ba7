// SPDX-License-Identifier: MIT
// A connection to a PostgreSQL server on which nothing waits for longer than a limit.
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
  using Answer = std::unique_ptr<PGresult, Clear>;

  /// `connection`: libpq's words; `password`: empty where none is needed, and in no message.
  static Result<Postgres> open(const std::string& connection, const std::string& password, Deadline until);

  /// One or more statements; the last one's answer. Refused: the server's own words in one line.
  Result<Answer> run(const std::string& sql, Deadline until);
  /// One statement with its parameters, as texts.
  Result<Answer> run(const std::string& sql, const std::vector<std::string>& parameters, Deadline until);
  /// COPY … FROM STDIN with these lines.
  Result<void> copy(const std::string& sql, std::string_view lines, Deadline until);

  int socket() const { return PQsocket(connection_.get()); }

 private:
  struct Finish {
    void operator()(PGconn* connection) const { PQfinish(connection); }
  };
  explicit Postgres(PGconn* connection) : connection_(connection) {}
  Result<void> flush(Deadline until);
  Result<Answer> next(Deadline until);
  Result<Answer> last(Deadline until);
  tl::unexpected<Error> lost(std::string_view what) const;

  std::unique_ptr<PGconn, Finish> connection_;
};

/// A field as text; empty where it is null.
std::string field(const Postgres::Answer& answer, int row, int column);

}  // namespace prism::prismrelay
