// SPDX-License-Identifier: MIT
#include "tools/prismrelay/postgres.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "base/escape.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kPlace = "postgresql";
constexpr std::size_t kMaxMessageBytes = 1000;

// libpq's messages have several lines, some of them empty. They may quote our data: Error::text() makes them printable.
std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) line += c == '\n' || c == '\t' ? ' ' : c;
  while (!line.empty() && line.back() == ' ') line.pop_back();
  if (line.rfind("ERROR:  ", 0) == 0) line.erase(0, 8);
  if (line.size() > kMaxMessageBytes) line = shortened(line, kMaxMessageBytes);
  return line;
}

// Until the socket is ready; false where the time is over.
bool ready(int fd, short events, Postgres::Deadline until) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now()).count();
    if (left < 0) return false;
    pollfd wait{fd, events, 0};
    const int found = ::poll(&wait, 1, static_cast<int>(std::min<long>(left + 1, 60'000)));
    if (found > 0) return true;
    if (found < 0 && errno != EINTR) return false;
  }
}

}  // namespace

tl::unexpected<Error> Postgres::lost(std::string_view what) const {
  const std::string words = one_line(PQerrorMessage(connection_.get()));
  return make_error(kPlace, words.empty() ? std::string(what) : words);
}

Result<Postgres> Postgres::open(const std::string& connection, const std::string& password, Deadline until) {
  const std::array keys = {"dbname", "password", "fallback_application_name", static_cast<const char*>(nullptr)};
  const std::array values = {connection.c_str(), password.empty() ? nullptr : password.c_str(), "prismrelay",
                             static_cast<const char*>(nullptr)};
  Postgres made(PQconnectStartParams(keys.data(), values.data(), 1));
  if (!made.connection_) return make_error(kPlace, "no memory for a connection");
  for (PostgresPollingStatusType state = PGRES_POLLING_WRITING; state != PGRES_POLLING_OK;) {
    if (state == PGRES_POLLING_FAILED || PQstatus(made.connection_.get()) == CONNECTION_BAD)
      return made.lost("no server answers");
    if (!ready(made.socket(), state == PGRES_POLLING_READING ? POLLIN : POLLOUT, until))
      return make_error(kPlace, "no server answers within the time");
    state = PQconnectPoll(made.connection_.get());
  }
  PQsetnonblocking(made.connection_.get(), 1);
  PQsetNoticeProcessor(
      made.connection_.get(), [](void*, const char*) {}, nullptr);  // "relation exists, skipping"
  return made;
}

Result<void> Postgres::flush(Deadline until) {
  for (;;) {
    const int left = PQflush(connection_.get());
    if (left == 0) return {};
    if (left < 0) return lost("the connection is lost");
    if (!ready(socket(), POLLIN | POLLOUT, until)) return make_error(kPlace, "takes nothing within the time");
    if (PQconsumeInput(connection_.get()) == 0) return lost("the connection is lost");
  }
}

Result<Postgres::Answer> Postgres::next(Deadline until) {
  while (PQisBusy(connection_.get()) != 0) {
    if (!ready(socket(), POLLIN, until)) return make_error(kPlace, "no answer within the time");
    if (PQconsumeInput(connection_.get()) == 0) return lost("the connection is lost");
  }
  return Answer(PQgetResult(connection_.get()));
}

Result<Postgres::Answer> Postgres::last(Deadline until) {
  if (auto sent = flush(until); !sent) return tl::unexpected<Error>(sent.error());
  Answer found;
  Result<Answer> wrong = Answer();
  for (;;) {
    auto answer = next(until);
    if (!answer) return answer;
    if (!*answer) break;
    const ExecStatusType state = PQresultStatus(answer->get());
    if (state == PGRES_COPY_IN) return answer;
    if (state != PGRES_COMMAND_OK && state != PGRES_TUPLES_OK && wrong)
      wrong = make_error(kPlace, one_line(PQresultErrorMessage(answer->get())));
    found = std::move(*answer);
  }
  if (!wrong) return wrong;
  if (!found) return lost("the connection is lost");
  return found;
}

Result<Postgres::Answer> Postgres::run(const std::string& sql, Deadline until) {
  if (PQsendQuery(connection_.get(), sql.c_str()) == 0) return lost("the connection is lost");
  return last(until);
}

Result<Postgres::Answer> Postgres::run(const std::string& sql, const std::vector<std::string>& parameters,
                                       Deadline until) {
  std::vector<const char*> values;
  for (const std::string& parameter : parameters) values.push_back(parameter.c_str());
  if (PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()), nullptr, values.data(),
                        nullptr, nullptr, 0) == 0)
    return lost("the connection is lost");
  return last(until);
}

Result<void> Postgres::copy(const std::string& sql, std::string_view lines, Deadline until) {
  const auto begun = run(sql, until);
  if (!begun) return tl::unexpected<Error>(begun.error());
  constexpr std::size_t kPart = 64 << 10;
  while (!lines.empty()) {
    const std::string_view part = lines.substr(0, kPart);
    const int put = PQputCopyData(connection_.get(), part.data(), static_cast<int>(part.size()));
    if (put < 0) return lost("the connection is lost");
    if (put > 0) lines.remove_prefix(part.size());
    if (auto sent = flush(until); !sent) return sent;
  }
  while (PQputCopyEnd(connection_.get(), nullptr) == 0) {
    if (auto sent = flush(until); !sent) return sent;
  }
  if (const auto done = last(until); !done) return tl::unexpected<Error>(done.error());
  return {};
}

std::string field(const Postgres::Answer& answer, int row, int column) {
  return PQgetisnull(answer.get(), row, column) != 0 ? "" : PQgetvalue(answer.get(), row, column);
}

}  // namespace prism::prismrelay
