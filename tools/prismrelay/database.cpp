// SPDX-License-Identifier: MIT
#include "tools/prismrelay/database.hpp"

#include <fmt/format.h>
#include <libpq-fe.h>

#include <array>
#include <functional>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/text_number.hpp"

namespace prism::prismrelay {

template <auto function>
struct Free {
  void operator()(auto* object) const { function(object); }
};

namespace {

constexpr const char* kServer = "postgresql";

// The files of schema/ by number, from 1.
constexpr const char* kSchemaFiles[] = {
#include "tools/prismrelay/schema.inc"
};
constexpr int kSchemaVersion = std::size(kSchemaFiles);

/// A table of the schema. `merge` copies lines into in_NAME, a temporary table with the same columns, and inserts those
/// that do not exist. `copy` is faster: an existing line is an error.
struct Destination {
  Destination(const char* name, const std::string& columns, const char* conflict = "DO NOTHING",
              const char* format = "csv")
      : create(fmt::format("CREATE TEMPORARY TABLE in_{0} ON COMMIT DELETE ROWS AS SELECT {1} FROM prism.{0} LIMIT 0;",
                           name, columns)),
        copy(fmt::format("COPY prism.{} ({}) FROM STDIN (FORMAT {})", name, columns, format)),
        merge(fmt::format("DELETE FROM in_{0}; COPY in_{0} FROM STDIN (FORMAT {3}); "
                          "INSERT INTO prism.{0} AS old ({1}) SELECT {1} FROM in_{0} ON CONFLICT {2}",
                          name, columns, conflict, format)) {}
  std::string create, copy, merge;
};

// In the order of Table.
const std::array<Destination, kTables>& destinations() {
  static const std::array<Destination, kTables> kDestinations = {{
      {"segments", "gyro, axis, log, segment, file, model, metadata"},
      {"rows", row_columns(), "DO NOTHING", "binary"},
      {"gaps", "gyro, axis, kind, behind, missing"},
      {"events", "gyro, time, severity, kind, text"},
      {"refused_rows", "gyro, axis, log, segment, row_number, why, line"},
      {"places", "gyro, axis, cursor, log, segment, row_number, arrival, rows",
       "(gyro, axis) DO UPDATE SET cursor = excluded.cursor, log = coalesce(excluded.log, old.log), "
       "segment = coalesce(excluded.segment, old.segment), "
       "row_number = coalesce(excluded.row_number, old.row_number), "
       "arrival = coalesce(excluded.arrival, old.arrival), rows = old.rows + excluded.rows, updated = now()"},
  }};
  return kDestinations;
}

// The timeouts end a session whose client is gone: it would keep locks on the rows of prism.places.
std::string session_sql() {
  std::string sql =
      "SET idle_in_transaction_session_timeout = '30s'; SET tcp_keepalives_idle = 10; "
      "SET tcp_keepalives_interval = 5; SET tcp_keepalives_count = 3; SET synchronous_commit = on;";
  for (const Destination& table : destinations()) sql += table.create;
  return sql;
}

// Joins the lines of a message of libpq. It may quote data: Error::text() makes it printable.
std::string one_line(std::string_view text) {
  constexpr std::string_view kError = "ERROR:  ";
  std::string line(text.substr(text.starts_with(kError) ? kError.size() : 0));
  for (char& c : line) c = c == '\n' || c == '\t' ? ' ' : c;
  line.erase(line.find_last_not_of(' ') + 1);
  return line.size() > 1000 ? shortened(line, 1000) : line;
}

template <class T>
tl::unexpected<Error> error_of(const Result<T>& result) {
  return tl::unexpected<Error>(result.error());
}

using QueryResult = std::unique_ptr<PGresult, Free<PQclear>>;

// A field as text; empty if it is null.
std::string field(const QueryResult& result, int row, int column) {
  return PQgetisnull(result.get(), row, column) != 0 ? "" : PQgetvalue(result.get(), row, column);
}

}  // namespace

/// Connection to the server. A lost network ends an operation after 20 s; a server that is only slow is waited for.
class Session {
 public:
  static Result<std::shared_ptr<Session>> open(const PostgresSettings& settings) {
    std::string password;  // no error message contains it
    if (!settings.password_file.empty()) {
      auto read = read_password(settings.password_file);
      if (!read) return error_of(read);
      password = std::move(*read);
    }
    const char* const keys[] = {
        "fallback_application_name", "client_encoding",  "connect_timeout", "tcp_user_timeout", "keepalives_idle",
        "keepalives_interval",       "keepalives_count", "dbname",          "password",         nullptr};
    const char* const values[] = {"prismrelay",     "UTF8", "20", "20000", "10", "5", "2", settings.connection.c_str(),
                                  password.c_str(),  // an empty value is ignored
                                  nullptr};
    std::shared_ptr<Session> opened(new Session(PQconnectdbParams(keys, values, 1)));
    PGconn* const handle = opened->connection_.get();
    if (PQstatus(handle) != CONNECTION_OK) return opened->error();
    const std::string_view encoding = PQparameterStatus(handle, "server_encoding");
    if (encoding != "UTF8" && encoding != "SQL_ASCII")
      return make_error(kServer, fmt::format("the database has the encoding {}, expected UTF8", encoding));
    PQsetErrorContextVisibility(handle, PQSHOW_CONTEXT_NEVER);  // it names the row of a batch: one fault, many texts
    PQsetNoticeProcessor(
        handle, [](void*, const char*) {}, nullptr);  // e.g. "relation exists, skipping"
    return opened;
  }

  /// Runs one or more statements and returns the result of the last one. Errors: the server's message in one line.
  Result<QueryResult> query(const std::string& sql) {
    return checked(QueryResult(PQexec(connection_.get(), sql.c_str())));
  }
  Result<void> run(const std::string& sql) {
    if (const auto done = query(sql); !done) return error_of(done);
    return {};
  }

  /// Runs statements of which one is COPY … FROM STDIN, with `lines`.
  Result<void> copy(const std::string& sql, const std::string& lines, bool is_binary) {
    constexpr std::string_view kHeader("PGCOPY\n\377\r\n\0\0\0\0\0\0\0\0\0", 19), kEnd("\377\377", 2);
    if (auto begun = run(sql); !begun) return begun;
    for (const std::string_view part : {is_binary ? kHeader : "", std::string_view(lines), is_binary ? kEnd : ""}) {
      if (PQputCopyData(connection_.get(), part.data(), static_cast<int>(part.size())) != 1) return error();
    }
    if (PQputCopyEnd(connection_.get(), nullptr) != 1) return error();
    Result<QueryResult> done = QueryResult();
    while (PGresult* const result = PQgetResult(connection_.get())) {
      QueryResult next(result);
      if (done) done = checked(std::move(next));
    }
    if (!done) return error_of(done);
    return {};
  }

  /// True if the data are the fault: data exception, integrity constraint violation, program limit exceeded (size of an
  /// index entry). Other errors, e.g. a full disk or an exception of a trigger (P0001), may end without a change of the
  /// data.
  bool is_refused(const Result<void>& done) const {
    const std::string kind = done ? "" : sqlstate_.substr(0, 2);
    return kind == "22" || kind == "23" || kind == "54";
  }

  /// Text as a literal in SQL.
  std::string quoted(const std::string& text) const {
    const std::unique_ptr<char, Free<PQfreemem>> literal(PQescapeLiteral(connection_.get(), text.data(), text.size()));
    return literal ? literal.get() : "''";
  }

 private:
  explicit Session(PGconn* connection) : connection_(connection) {}

  tl::unexpected<Error> error() const {
    const std::string message = one_line(PQerrorMessage(connection_.get()));
    return make_error(kServer, message.empty() ? "connection lost" : message);
  }

  Result<QueryResult> checked(QueryResult result) {
    const ExecStatusType state = PQresultStatus(result.get());
    sqlstate_.clear();
    if (state == PGRES_COMMAND_OK || state == PGRES_TUPLES_OK || state == PGRES_COPY_IN) return result;
    const char* const code = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
    if (code == nullptr) return error();
    sqlstate_ = code;
    return make_error(kServer, one_line(PQresultErrorMessage(result.get())));
  }

  std::unique_ptr<PGconn, Free<PQfinish>> connection_;
  std::string sqlstate_;  // of the last failed operation; empty: not of the server
};

namespace {

// "2026-11-23" for days since 1970 UTC.
std::string day_text(std::int64_t day) { return utc_text(day * 86400).substr(0, 10); }

// The version of the schema, 0 if it does not exist. Errors: a later one.
Result<int> schema_version(Session& session) {
  const auto table = session.query("SELECT to_regclass('prism.version')");
  if (!table) return error_of(table);
  if (field(*table, 0, 0).empty()) return 0;
  const auto row = session.query("SELECT coalesce(max(version), 0) FROM prism.version");
  if (!row) return error_of(row);
  const int version = std::stoi(field(*row, 0, 0));
  if (version > kSchemaVersion)
    return make_error(kServer, fmt::format("found version {} of the schema prism, expected {}: created by a later "
                                           "prismrelay",
                                           version, kSchemaVersion));
  return version;
}

// Creates those that do not exist, in transactions of their own, because a new partition locks the table. The advisory
// lock serialises them over all relays.
Result<void> make_partitions(Session& session, const std::set<std::int64_t>& days) {
  for (const std::int64_t day : days) {
    const std::string name = "rows_" + utc_file_text(day * 86400).substr(0, 8);
    const std::string create = fmt::format(
        "BEGIN; SELECT pg_advisory_xact_lock(hashtext('prism.rows')); CREATE TABLE IF NOT EXISTS prism.{} PARTITION OF "
        "prism.rows FOR VALUES FROM ('{} 00:00:00+00') TO ('{} 00:00:00+00'); COMMIT",
        name, day_text(day), day_text(day + 1));
    if (auto done = session.run(create); !done) return done;
    const auto made = session.query(fmt::format("SELECT FROM prism.days WHERE day = '{}'", day_text(day)));
    if (!made) return error_of(made);
    if (PQntuples(made->get()) == 0)
      return make_error(kServer, "prism." + name + " exists, but is not a partition of prism.rows; rename or drop it");
  }
  return {};
}

// `is_new`: the rows do not exist.
Result<void> store_texts(Session& session, const Texts& texts, bool is_new = false) {
  for (std::size_t i = 0; i < kTables; ++i) {
    const Destination& to = destinations()[i];
    const bool is_copied = is_new && i == kRows;
    if (texts[i].empty()) continue;
    if (auto done = session.copy(is_copied ? to.copy : to.merge, texts[i], i == kRows); !done) return done;
  }
  return {};
}

// Does the work, or nothing if the server refuses the data: then returns the reason, else nullopt.
Result<std::optional<std::string>> attempt(Session& session, const std::function<Result<void>()>& work) {
  auto done = session.run("SAVEPOINT attempt");
  if (done) done = work();
  if (!done && !session.is_refused(done)) return error_of(done);
  const auto ended = session.run(done ? "RELEASE attempt" : "ROLLBACK TO attempt; RELEASE attempt");
  if (!ended) return error_of(ended);
  return done ? std::nullopt : std::optional(done.error().what);
}

// Line by line. Refused rows and segments get a line in refused_rows; refused gaps and events are only reported.
// Errors: also the server's reason to refuse the cursor.
Result<void> store_lines(Session& session, BatchItem& item) {
  for (const Table table : {kSegments, kRows, kGaps, kEvents}) {
    std::size_t begin = 0;
    for (Record& record : item.records[table]) {
      Texts line;
      line[table] = item.texts[table].substr(begin, record.end - begin);
      begin = record.end;
      const auto refused = attempt(session, [&] { return store_texts(session, line); });
      if (!refused) return error_of(refused);
      if (*refused) item.refuse(table, record, **refused);
    }
  }
  Texts last;
  last[kRefused] = item.texts[kRefused];
  last[kPlaces] = place_line(item);
  return store_texts(session, last);
}

// SET CONSTRAINTS: a deferred constraint would refuse the complete transaction.
Result<void> store_items(Session& session, const Batch& batch) {
  if (auto begun = session.run("BEGIN; SET CONSTRAINTS ALL IMMEDIATE"); !begun) return begun;
  for (const auto& item : batch) {
    auto refused = attempt(session, [&] { return store_texts(session, item->texts); });
    if (refused && *refused) refused = attempt(session, [&] { return store_lines(session, *item); });
    if (!refused) return error_of(refused);
    item->cursor_error = refused->value_or("");
  }
  return session.run("COMMIT");
}

}  // namespace

std::string schema_sql() {
  std::string sql = "BEGIN;\n";
  for (const char* const file : kSchemaFiles) sql += file;
  return sql + "COMMIT;\n";
}

Result<std::string> init_schema(const PostgresSettings& settings) {
  const auto opened = Session::open(settings);
  if (!opened) return error_of(opened);
  Session& session = **opened;
  const auto locked = session.run("BEGIN; SELECT pg_advisory_xact_lock(hashtext('prism.version'))");
  if (!locked) return error_of(locked);
  const auto version = schema_version(session);
  if (!version) return error_of(version);
  if (*version == kSchemaVersion) return fmt::format("schema prism exists, version {}", kSchemaVersion);
  std::string sql;
  for (int file = *version; file < kSchemaVersion; ++file) sql += kSchemaFiles[file];
  if (const auto done = session.run(sql + "COMMIT"); !done) return error_of(done);
  return *version == 0 ? fmt::format("created schema prism, version {}", kSchemaVersion)
                       : fmt::format("updated schema prism from version {} to {}", *version, kSchemaVersion);
}

Result<std::map<LogKey, std::string>> connect(const PostgresSettings& settings, const std::string& site,
                                              std::shared_ptr<Session>& connected) {
  const auto opened = Session::open(settings);
  if (!opened) return error_of(opened);
  connected = *opened;
  Session& session = *connected;
  const auto version = schema_version(session);
  if (!version) return error_of(version);
  if (*version == 0) return make_error(kServer, "has no schema prism; create it with prismrelay --init");
  if (*version != kSchemaVersion)
    return make_error(kServer, fmt::format("found version {} of the schema prism, expected {}; update it with "
                                           "prismrelay --init",
                                           *version, kSchemaVersion));
  if (const auto done = session.run(session_sql()); !done) return error_of(done);
  const auto places = session.query("SELECT gyro, axis, cursor FROM prism.places WHERE starts_with(gyro, " +
                                    session.quoted(site + "/") + ") FOR UPDATE");  // waits for an earlier connection
  if (!places) return error_of(places);
  std::map<LogKey, std::string> cursors;
  for (int i = 0; i < PQntuples(places->get()); ++i)
    cursors[{field(*places, i, 0), field(*places, i, 1)}] = field(*places, i, 2);
  return cursors;
}

Result<void> commit(Session& session, const Batch& batch) {
  std::set<std::int64_t> days;
  Texts texts;
  for (const auto& item : batch) {
    days.insert(item->days.begin(), item->days.end());
    for (std::size_t i = 0; i < kTables; ++i) texts[i] += item->texts[i];
  }
  auto done = session.run("BEGIN");
  if (done) done = store_texts(session, texts, true);
  if (done) done = session.run("COMMIT");
  if (!session.is_refused(done)) return done;
  if (auto ended = session.run("ROLLBACK"); !ended) return ended;
  if (auto made = make_partitions(session, days); !made) return made;
  return store_items(session, batch);
}

Result<std::vector<std::string>> keep_partitions(Session& session, std::optional<int> keep_days) {
  std::vector<std::string> dropped;
  const std::int64_t today = static_cast<std::int64_t>(host_time_s()) / 86400;
  if (const auto made = make_partitions(session, {today, today + 1, today + 2}); !made) return error_of(made);
  if (!keep_days) return dropped;
  const auto old = session.query(
      fmt::format("SELECT 'rows_' || to_char(day, 'YYYYMMDD'), rows_about, pg_size_pretty(bytes) FROM prism.days "
                  "WHERE day < (now() AT TIME ZONE 'UTC')::date - {} ORDER BY day",
                  *keep_days));
  if (!old) return error_of(old);
  for (int i = 0; i < PQntuples(old->get()); ++i) {
    const std::string name = field(*old, i, 0);
    if (const auto done = session.run("DROP TABLE prism." + name); !done) return error_of(done);
    dropped.push_back(fmt::format("dropped {} (about {} rows, {}): older than keep_days {}", name, field(*old, i, 1),
                                  field(*old, i, 2), *keep_days));
  }
  return dropped;
}

}  // namespace prism::prismrelay
