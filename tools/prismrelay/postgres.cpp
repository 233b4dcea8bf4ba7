// SPDX-License-Identifier: MIT
#include "tools/prismrelay/postgres.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "base/escape.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kPostgres = "postgresql";

// Joins the lines of a message of libpq. It may quote data: Error::text() makes it printable.
std::string one_line(std::string_view text) {
  constexpr std::string_view kError = "ERROR:  ";
  std::string line(text.substr(text.starts_with(kError) ? kError.size() : 0));
  for (char& c : line) c = c == '\n' || c == '\t' ? ' ' : c;
  line.erase(line.find_last_not_of(' ') + 1);
  return line.size() > 1000 ? shortened(line, 1000) : line;
}

}  // namespace

tl::unexpected<Error> Postgres::connection_error(std::string_view fallback) const {
  const std::string message = one_line(PQerrorMessage(connection_.get()));
  return make_error(kPostgres, message.empty() ? std::string(fallback) : message);
}

// Waits until the socket is ready. Returns false at the end of the operation's time, or if poll() fails.
bool Postgres::wait(short events) const {
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until_ - Clock::now()).count();
    if (left < 0) return false;
    pollfd socket{PQsocket(connection_.get()), events, 0};
    const int ready = ::poll(&socket, 1, static_cast<int>(left) + 1);
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

Result<Postgres> Postgres::open(const std::string& connection, const std::string& password,
                                std::chrono::seconds timeout) {
  const std::array keys = {"dbname", "password", "fallback_application_name", "client_encoding",
                           static_cast<const char*>(nullptr)};
  const std::array values = {connection.c_str(), password.empty() ? nullptr : password.c_str(), "prismrelay", "UTF8",
                             static_cast<const char*>(nullptr)};
  Postgres opened(PQconnectStartParams(keys.data(), values.data(), 1), timeout);
  PGconn* const handle = opened.connection_.get();
  if (handle == nullptr) return make_error(kPostgres, "out of memory");
  for (PostgresPollingStatusType state = PGRES_POLLING_WRITING; state != PGRES_POLLING_OK;) {
    if (state == PGRES_POLLING_FAILED || PQstatus(handle) == CONNECTION_BAD)
      return opened.connection_error("cannot connect");
    if (!opened.wait(state == PGRES_POLLING_READING ? POLLIN : POLLOUT))
      return make_error(kPostgres, "connection timed out");
    state = PQconnectPoll(handle);
  }
  const std::string_view encoding = PQparameterStatus(handle, "server_encoding");
  if (encoding != "UTF8" && encoding != "SQL_ASCII")
    return make_error(kPostgres, fmt::format("the database has the encoding {}, expected UTF8", encoding));
  PQsetnonblocking(handle, 1);
  PQsetNoticeProcessor(
      handle, [](void*, const char*) {}, nullptr);  // e.g. "relation exists, skipping"
  return opened;
}

Result<void> Postgres::flush() {
  for (;;) {
    const int left = PQflush(connection_.get());
    if (left == 0) return {};
    if (left < 0) return connection_error();
    if (!wait(POLLIN | POLLOUT)) return make_error(kPostgres, "write timed out");
    if (PQconsumeInput(connection_.get()) == 0) return connection_error();
  }
}

// Returns the last result, the first error, or the begin of COPY.
Result<Postgres::QueryResult> Postgres::last_result() {
  if (auto sent = flush(); !sent) return tl::unexpected<Error>(sent.error());
  QueryResult last;
  Result<QueryResult> error = QueryResult();
  for (;;) {
    while (PQisBusy(connection_.get()) != 0) {
      if (!wait(POLLIN)) return make_error(kPostgres, "response timed out");
      if (PQconsumeInput(connection_.get()) == 0) return connection_error();
    }
    QueryResult result(PQgetResult(connection_.get()));
    if (!result) break;
    const ExecStatusType state = PQresultStatus(result.get());
    if (state == PGRES_COPY_IN) return result;
    if (state != PGRES_COMMAND_OK && state != PGRES_TUPLES_OK && error) {
      error = make_error(kPostgres, one_line(PQresultErrorMessage(result.get())));
      const char* const code = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
      sqlstate_ = code != nullptr ? code : "";
    }
    last = std::move(result);
  }
  if (!error) return error;
  if (!last) return connection_error();
  return last;
}

Result<Postgres::QueryResult> Postgres::run(const std::string& sql, const std::vector<std::string>& parameters) {
  until_ = Clock::now() + timeout_;
  sqlstate_.clear();
  std::vector<const char*> values;
  for (const std::string& parameter : parameters) values.push_back(parameter.c_str());
  const int sent = values.empty() ? PQsendQuery(connection_.get(), sql.c_str())  // allows several statements
                                  : PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()),
                                                      nullptr, values.data(), nullptr, nullptr, 0);
  if (sent == 0) return connection_error();
  return last_result();
}

Result<void> Postgres::copy(const std::string& sql, std::string_view lines) {
  if (const auto begun = run(sql); !begun) return tl::unexpected<Error>(begun.error());
  while (!lines.empty()) {
    const std::string_view part = lines.substr(0, 64 << 10);
    const int queued = PQputCopyData(connection_.get(), part.data(), static_cast<int>(part.size()));
    if (queued < 0) return connection_error();
    if (queued > 0) lines.remove_prefix(part.size());
    if (auto sent = flush(); !sent) return sent;
  }
  while (PQputCopyEnd(connection_.get(), nullptr) == 0) {
    if (auto sent = flush(); !sent) return sent;
  }
  if (const auto done = last_result(); !done) return tl::unexpected<Error>(done.error());
  return {};
}

std::string field(const Postgres::QueryResult& result, int row, int column) {
  return PQgetisnull(result.get(), row, column) != 0 ? "" : PQgetvalue(result.get(), row, column);
}

}  // namespace prism::prismrelay
