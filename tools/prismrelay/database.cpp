// SPDX-License-Identifier: MIT
#include "tools/prismrelay/database.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <utility>

#include "base/escape.hpp"
#include "base/text_number.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kWhere = "postgresql";
constexpr std::chrono::seconds kTimeout{20};
constexpr std::chrono::seconds kInitTimeout{60};  // another --init, or an index of a large table

// The files of schema/ by number, from 1.
constexpr const char* kSchemaFiles[] = {
#include "tools/prismrelay/schema.inc"
};
constexpr int kSchemaVersion = std::size(kSchemaFiles);

/// A temporary table that COPY fills, and the statement that inserts its rows into the final table: all, or `where`
/// they are of a Record.
struct StagingTable {
  std::string name, definition, columns, insert, conflict, where;
  std::string copy = "COPY " + name + " (" + columns + ") FROM STDIN (FORMAT csv); ";
};

// In the order of Table. in_rows has the columns of prism.rows, and the times as numbers.
const std::array<StagingTable, kTables>& staging_tables() {
  static const auto kStagingTables = [] {
    const std::string skip = " ON CONFLICT DO NOTHING";
    const std::string columns = row_columns();
    std::string names = columns, values = columns;
    for (const std::string time : {"arrival", "time"}) {
      names.replace(names.find(time + "_s"), time.size() + 2, time);
      values.replace(values.find(time + "_s"), time.size() + 2, "to_timestamp(" + time + "_s)");
    }
    return std::array<StagingTable, kTables>{{
        {"in_segments", "(gyro text, axis text, log uuid, segment integer, file text, model text, metadata jsonb)",
         "gyro, axis, log, segment, file, model, metadata",
         "INSERT INTO prism.segments (gyro, axis, log, segment, file, model, metadata) SELECT * FROM in_segments", skip,
         " WHERE segment = {}"},
        {"in_rows", "", columns, "INSERT INTO prism.rows (" + names + ") SELECT " + values + " FROM in_rows", skip,
         " WHERE (segment, row_number) = ({}, {})"},
        {"in_gaps", "(gyro text, axis text, kind text, behind text, missing bigint)",
         "gyro, axis, kind, behind, missing",
         "INSERT INTO prism.gaps (gyro, axis, kind, behind, missing) SELECT * FROM in_gaps", skip, ""},
        {"in_events", "(gyro text, time_s double precision, severity text, kind text, text text)",
         "gyro, time_s, severity, kind, text",
         "INSERT INTO prism.events (gyro, time, severity, kind, text) "
         "SELECT gyro, to_timestamp(time_s), severity, kind, text FROM in_events",
         skip, ""},
        {"in_refused", "(gyro text, axis text, log uuid, segment integer, row_number integer, why text, line text)",
         "gyro, axis, log, segment, row_number, why, line",
         "INSERT INTO prism.refused_rows (gyro, axis, log, segment, row_number, why, line) SELECT * FROM in_refused",
         skip, ""},
        {"in_places",
         "(gyro text, axis text, cursor text, log uuid, segment integer, row_number integer, arrival_s double "
         "precision, rows bigint)",
         "gyro, axis, cursor, log, segment, row_number, arrival_s, rows",
         "INSERT INTO prism.places AS p (gyro, axis, cursor, log, segment, row_number, arrival, rows) "
         "SELECT gyro, axis, cursor, log, segment, row_number, to_timestamp(arrival_s), rows FROM in_places",
         " ON CONFLICT (gyro, axis) DO UPDATE SET cursor = excluded.cursor, log = coalesce(excluded.log, p.log), "
         "segment = coalesce(excluded.segment, p.segment), "
         "row_number = coalesce(excluded.row_number, p.row_number), arrival = coalesce(excluded.arrival, p.arrival), "
         "rows = p.rows + excluded.rows, updated = now()",
         ""},
    }};
  }();
  return kStagingTables;
}

// The timeouts end a session whose client is gone: it would keep locks on the rows of prism.places.
std::string session_sql() {
  std::string sql =
      "SET idle_in_transaction_session_timeout = '30s'; SET tcp_keepalives_idle = 10; "
      "SET tcp_keepalives_interval = 5; SET tcp_keepalives_count = 3; SET synchronous_commit = on;";
  for (const StagingTable& table : staging_tables()) {
    const std::string definition = !table.definition.empty()
                                       ? table.definition + " ON COMMIT DELETE ROWS"
                                       : " ON COMMIT DELETE ROWS AS SELECT *, 0::double precision AS arrival_s, "
                                         "0::double precision AS time_s FROM prism.rows LIMIT 0";
    sql += fmt::format("CREATE TEMPORARY TABLE {} {};", table.name, definition);
  }
  return sql;
}

template <class T>
tl::unexpected<Error> error_of(const Result<T>& result) {
  return tl::unexpected<Error>(result.error());
}

std::int64_t today() {
  return std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now()).time_since_epoch().count();
}

// "2026-11-23" for days since 1970 UTC.
std::string day_text(std::int64_t day) { return utc_text(day * 86400).substr(0, 10); }

// rows_20261123
std::string partition_name(std::int64_t day) {
  std::string name = day_text(day);
  std::erase(name, '-');
  return "rows_" + name;
}

Result<Postgres> open_database(const PostgresSettings& settings, std::chrono::seconds timeout) {
  std::string password;
  if (!settings.password_file.empty()) {
    auto read = read_password(settings.password_file);
    if (!read) return error_of(read);
    password = std::move(*read);
  }
  return Postgres::open(settings.connection, password, timeout);
}

// The version of the schema, 0 if it does not exist. Errors: a later one.
Result<int> schema_version(Postgres& connection) {
  const auto table = connection.run("SELECT to_regclass('prism.version')");
  if (!table) return error_of(table);
  if (field(*table, 0, 0).empty()) return 0;
  const auto row = connection.run("SELECT coalesce(max(version), 0) FROM prism.version");
  if (!row) return error_of(row);
  const int version = std::stoi(field(*row, 0, 0));
  if (version > kSchemaVersion)
    return make_error(kWhere, fmt::format("found version {} of the schema prism, expected {}: created by a later "
                                          "prismrelay",
                                          version, kSchemaVersion));
  return version;
}

}  // namespace

std::string schema_sql() {
  std::string sql = "BEGIN;\n";
  for (const char* const file : kSchemaFiles) sql += file;
  return sql + "COMMIT;\n";
}

Result<std::string> init_schema(const PostgresSettings& settings) {
  auto connection = open_database(settings, kInitTimeout);
  if (!connection) return error_of(connection);
  const auto locked = connection->run("BEGIN; SELECT pg_advisory_xact_lock(hashtext('prism.version'))");
  if (!locked) return error_of(locked);
  const auto version = schema_version(*connection);
  if (!version) return error_of(version);
  if (*version == kSchemaVersion) return fmt::format("schema prism exists, version {}", kSchemaVersion);
  std::string sql;
  for (int file = *version; file < kSchemaVersion; ++file) sql += kSchemaFiles[file];
  if (const auto done = connection->run(sql + "COMMIT"); !done) return error_of(done);
  return *version == 0 ? fmt::format("created schema prism, version {}", kSchemaVersion)
                       : fmt::format("updated schema prism from version {} to {}", *version, kSchemaVersion);
}

// Closes the connection after an error.
template <class T>
Result<T> Database::keep(Result<T> done) {
  if (!done) connection_.reset();
  return done;
}

Result<void> Database::run(const std::string& sql) {
  if (const auto done = connection_->run(sql); !done) return error_of(done);
  return {};
}

// The data are the fault: data exception, integrity constraint violation, program limit exceeded (size of an index
// entry). Others, e.g. a full disk or an exception of a trigger (P0001), may end without a change of the data.
bool Database::is_refused(const Result<void>& done) const {
  const std::string kind = done ? "" : connection_->sqlstate().substr(0, 2);
  return kind == "22" || kind == "23" || kind == "54";
}

Result<std::map<LogKey, std::string>> Database::connect() {
  connection_.reset();
  auto opened = open_database(settings_, kTimeout);
  if (!opened) return error_of(opened);
  connection_ = std::move(*opened);
  return keep(read_cursors());
}

Result<std::map<LogKey, std::string>> Database::read_cursors() {
  const auto version = schema_version(*connection_);
  if (!version) return error_of(version);
  if (*version == 0) return make_error(kWhere, "has no schema prism; create it with prismrelay --init");
  if (*version != kSchemaVersion)
    return make_error(kWhere, fmt::format("found version {} of the schema prism, expected {}; update it with "
                                          "prismrelay --init",
                                          *version, kSchemaVersion));
  if (const auto done = run(session_sql()); !done) return error_of(done);
  if (const auto done = read_days(); !done) return error_of(done);
  const auto places =
      connection_->run("SELECT gyro, axis, cursor FROM prism.places WHERE starts_with(gyro, $1) FOR UPDATE",
                       {site_ + "/"});  // FOR UPDATE waits for a commit of a previous connection
  if (!places) return error_of(places);
  std::map<LogKey, std::string> cursors;
  for (int i = 0; i < PQntuples(places->get()); ++i)
    cursors[{field(*places, i, 0), field(*places, i, 1)}] = field(*places, i, 2);
  return cursors;
}

Result<void> Database::read_days() {
  const auto days = connection_->run("SELECT day - '1970-01-01'::date FROM prism.days");
  if (!days) return error_of(days);
  days_.clear();
  for (int i = 0; i < PQntuples(days->get()); ++i) days_.insert(std::stoll(field(*days, i, 0)));
  return {};
}

// Separate transactions, because a new partition locks the table. The advisory lock serialises them over all relays.
Result<void> Database::make_partitions(const std::set<std::int64_t>& days) {
  for (const std::int64_t day : days) {
    if (days_.contains(day)) continue;
    if (auto done = run(fmt::format("BEGIN; SELECT pg_advisory_xact_lock(hashtext('prism.rows')); CREATE TABLE IF NOT "
                                    "EXISTS prism.{} PARTITION "
                                    "OF prism.rows FOR VALUES FROM ('{} 00:00:00+00') TO ('{} 00:00:00+00'); COMMIT",
                                    partition_name(day), day_text(day), day_text(day + 1)));
        !done)
      return done;
    if (auto done = read_days(); !done) return done;
    if (!days_.contains(day))
      return make_error(kWhere, fmt::format("prism.{} exists, but is not a partition of prism.rows; rename or drop it",
                                            partition_name(day)));
  }
  return {};
}

Result<void> Database::commit(const Batch& batch) { return keep(store(batch)); }

Result<void> Database::store(const Batch& batch) {
  std::set<std::int64_t> days;
  Texts texts;
  for (const auto& item : batch) {
    days.insert(item->days.begin(), item->days.end());
    for (std::size_t i = 0; i < kTables; ++i) texts[i] += item->texts[i];
    texts[static_cast<std::size_t>(Table::kPlaces)] += place_line(*item);
  }
  if (auto made = make_partitions(days); !made) return made;
  auto done = run("BEGIN");
  if (done) done = store_texts(texts);
  if (done) done = run("COMMIT");
  if (!is_refused(done)) return done;
  if (auto ended = run("ROLLBACK"); !ended) return ended;
  if (auto read = read_days(); !read) return read;  // another program may have dropped a partition
  if (auto made = make_partitions(days); !made) return made;
  return store_items(batch);
}

Result<void> Database::store_texts(const Texts& texts) {
  for (std::size_t i = 0; i < kTables; ++i) {
    const StagingTable& staging = staging_tables()[i];
    if (texts[i].empty()) continue;
    if (auto done = connection_->copy(staging.copy + staging.insert + staging.conflict, texts[i]); !done) return done;
  }
  return {};
}

// SET CONSTRAINTS: a deferred constraint would refuse the complete transaction.
Result<void> Database::store_items(const Batch& batch) {
  std::string begin;  // empties the tables before the savepoint, because ROLLBACK TO would fill them again
  for (const StagingTable& staging : staging_tables()) begin += "DELETE FROM " + staging.name + ";";
  begin += "SAVEPOINT item";
  if (auto begun = run("BEGIN; SET CONSTRAINTS ALL IMMEDIATE"); !begun) return begun;
  for (const auto& item : batch) {
    Texts texts = item->texts;
    texts[static_cast<std::size_t>(Table::kPlaces)] = place_line(*item);
    if (auto begun = run(begin); !begun) return begun;
    auto stored = store_texts(texts);
    if (is_refused(stored)) {
      if (auto ended = run("ROLLBACK TO item"); !ended) return ended;
      stored = store_lines(*item);
    }
    if (!stored && !is_refused(stored)) return stored;
    if (!stored) item->cursor_error = stored.error().what;
    if (auto ended = run(stored ? "RELEASE item" : "ROLLBACK TO item; RELEASE item"); !ended) return ended;
  }
  return run("COMMIT");
}

// Row by row. Refused rows and segments get a line in refused_rows; refused gaps and events are only reported.
Result<void> Database::store_lines(BatchItem& item) {
  for (const Table table : {Table::kSegments, Table::kRows, Table::kGaps, Table::kEvents}) {
    if (auto stored = store_lines(item, table); !stored) return stored;
  }
  Texts texts;
  texts[static_cast<std::size_t>(Table::kRefused)] = item.text(Table::kRefused);
  texts[static_cast<std::size_t>(Table::kPlaces)] = place_line(item);
  return store_texts(texts);
}

Result<void> Database::store_lines(BatchItem& item, Table table) {
  const StagingTable& staging = staging_tables()[static_cast<std::size_t>(table)];
  if (item.text(table).empty()) return {};
  if (auto copied = connection_->copy(staging.copy, item.text(table)); !copied) return copied;
  for (Record& record : item.of(table)) {
    const auto stored =
        run(fmt::format("SAVEPOINT line; {}{}{}; RELEASE line", staging.insert,
                        fmt::format(fmt::runtime(staging.where), record.segment, record.row), staging.conflict));
    if (stored) continue;
    if (!is_refused(stored)) return stored;
    item.refuse(table, record, stored.error().what);
    if (auto ended = run("ROLLBACK TO line; RELEASE line"); !ended) return ended;
  }
  return {};
}

Result<void> Database::ping() { return keep(run("SELECT 1")); }

Result<std::vector<std::string>> Database::keep_days() { return keep(drop_days()); }

Result<std::vector<std::string>> Database::drop_days() {
  std::vector<std::string> dropped;
  if (const auto made = make_partitions({today(), today() + 1, today() + 2}); !made) return error_of(made);
  if (!settings_.keep_days) return dropped;
  const auto old = connection_->run(
      "SELECT day - '1970-01-01'::date, rows_about, pg_size_pretty(bytes) FROM prism.days "
      "WHERE day < (now() AT TIME ZONE 'UTC')::date - $1::integer ORDER BY day",
      {std::to_string(*settings_.keep_days)});
  if (!old) return error_of(old);
  for (int i = 0; i < PQntuples(old->get()); ++i) {
    const std::int64_t day = std::stoll(field(*old, i, 0));
    if (const auto done = run("DROP TABLE prism." + partition_name(day)); !done) return error_of(done);
    days_.erase(day);
    dropped.push_back(fmt::format("dropped {} (about {} rows, {}): older than keep_days {}", partition_name(day),
                                  field(*old, i, 1), field(*old, i, 2), *settings_.keep_days));
  }
  return dropped;
}

}  // namespace prism::prismrelay
