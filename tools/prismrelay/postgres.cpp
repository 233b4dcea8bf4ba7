// SPDX-License-Identifier: MIT
#include "tools/prismrelay/postgres.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "base/escape.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kPostgres = "postgresql";
constexpr std::size_t kMaxMessageBytes = 1000;

// Joins the lines of a message of libpq. It may quote data: Error::text() makes it printable.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) line += c == '\n' || c == '\t' ? ' ' : c;
  while (!line.empty() && line.back() == ' ') line.pop_back();
  if (line.rfind("ERROR:  ", 0) == 0) line.erase(0, 8);
  if (line.size() > kMaxMessageBytes) line = shortened(line, kMaxMessageBytes);
  return line;
}

// Waits until the socket is ready. Returns false after `until`, or if poll() fails.
bool wait_until_ready(int fd, short events, Postgres::Deadline until) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now()).count();
    if (left < 0) return false;
    pollfd wait{fd, events, 0};
    const int ready = ::poll(&wait, 1, static_cast<int>(std::min<long>(left + 1, 60'000)));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

}  // namespace

tl::unexpected<Error> Postgres::connection_error(std::string_view fallback) const {
  const std::string message = one_line(PQerrorMessage(connection_.get()));
  return make_error(kPostgres, message.empty() ? std::string(fallback) : message);
}

Result<Postgres> Postgres::open(const std::string& connection, const std::string& password, Deadline until) {
  const std::array keys = {"dbname", "password", "fallback_application_name", static_cast<const char*>(nullptr)};
  const std::array values = {connection.c_str(), password.empty() ? nullptr : password.c_str(), "prismrelay",
                             static_cast<const char*>(nullptr)};
  Postgres opened(PQconnectStartParams(keys.data(), values.data(), 1));
  if (!opened.connection_) return make_error(kPostgres, "out of memory");
  for (PostgresPollingStatusType state = PGRES_POLLING_WRITING; state != PGRES_POLLING_OK;) {
    if (state == PGRES_POLLING_FAILED || PQstatus(opened.connection_.get()) == CONNECTION_BAD)
      return opened.connection_error("cannot connect");
    if (!wait_until_ready(opened.socket(), state == PGRES_POLLING_READING ? POLLIN : POLLOUT, until))
      return make_error(kPostgres, "connection timed out");
    state = PQconnectPoll(opened.connection_.get());
  }
  PQsetnonblocking(opened.connection_.get(), 1);
  PQsetNoticeProcessor(
      opened.connection_.get(), [](void*, const char*) {}, nullptr);  // e.g. "relation exists, skipping"
  return opened;
}

Result<void> Postgres::flush(Deadline until) {
  for (;;) {
    const int left = PQflush(connection_.get());
    if (left == 0) return {};
    if (left < 0) return connection_error();
    if (!wait_until_ready(socket(), POLLIN | POLLOUT, until)) return make_error(kPostgres, "write timed out");
    if (PQconsumeInput(connection_.get()) == 0) return connection_error();
  }
}

Result<Postgres::QueryResult> Postgres::next_result(Deadline until) {
  while (PQisBusy(connection_.get()) != 0) {
    if (!wait_until_ready(socket(), POLLIN, until)) return make_error(kPostgres, "response timed out");
    if (PQconsumeInput(connection_.get()) == 0) return connection_error();
  }
  return QueryResult(PQgetResult(connection_.get()));
}

Result<Postgres::QueryResult> Postgres::last_result(Deadline until) {
  sqlstate_.clear();
  if (auto sent = flush(until); !sent) return tl::unexpected<Error>(sent.error());
  QueryResult last;
  Result<QueryResult> first_error = QueryResult();
  for (;;) {
    auto result = next_result(until);
    if (!result) return result;
    if (!*result) break;
    const ExecStatusType state = PQresultStatus(result->get());
    if (state == PGRES_COPY_IN) return result;
    if (state != PGRES_COMMAND_OK && state != PGRES_TUPLES_OK && first_error) {
      first_error = make_error(kPostgres, one_line(PQresultErrorMessage(result->get())));
      const char* const code = PQresultErrorField(result->get(), PG_DIAG_SQLSTATE);
      sqlstate_ = code != nullptr ? code : "";
    }
    last = std::move(*result);
  }
  if (!first_error) return first_error;
  if (!last) return connection_error();
  return last;
}

Result<Postgres::QueryResult> Postgres::run(const std::string& sql, Deadline until) {
  sqlstate_.clear();
  if (PQsendQuery(connection_.get(), sql.c_str()) == 0) return connection_error();
  return last_result(until);
}

Result<Postgres::QueryResult> Postgres::run(const std::string& sql, const std::vector<std::string>& parameters,
                                            Deadline until) {
  std::vector<const char*> values;
  for (const std::string& parameter : parameters) values.push_back(parameter.c_str());
  if (PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()), nullptr, values.data(),
                        nullptr, nullptr, 0) == 0)
    return connection_error();
  return last_result(until);
}

Result<void> Postgres::copy(const std::string& sql, std::string_view lines, Deadline until) {
  const auto started = run(sql, until);
  if (!started) return tl::unexpected<Error>(started.error());
  constexpr std::size_t kMaxPartBytes = 64 << 10;
  while (!lines.empty()) {
    const std::string_view part = lines.substr(0, kMaxPartBytes);
    const int queued = PQputCopyData(connection_.get(), part.data(), static_cast<int>(part.size()));
    if (queued < 0) return connection_error();
    if (queued > 0) lines.remove_prefix(part.size());
    if (auto sent = flush(until); !sent) return sent;
  }
  while (PQputCopyEnd(connection_.get(), nullptr) == 0) {
    if (auto sent = flush(until); !sent) return sent;
  }
  if (const auto done = last_result(until); !done) return tl::unexpected<Error>(done.error());
  return {};
}

std::string field(const Postgres::QueryResult& result, int row, int column) {
  return PQgetisnull(result.get(), row, column) != 0 ? "" : PQgetvalue(result.get(), row, column);
}

}  // namespace prism::prismrelay
