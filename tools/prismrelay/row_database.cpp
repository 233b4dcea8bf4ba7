// SPDX-License-Identifier: MIT
#include "tools/prismrelay/row_database.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <string>
#include <utility>

#include "tools/prismrelay/schema.hpp"
#include "tools/prismrelay/schema_init.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kWhere = "postgresql";

/// A temporary table that COPY fills, and the statement that inserts its rows into the final table.
struct StagingTable {
  const char* table;
  const char* definition;
  const char* columns;
  const char* insert;
};

// In the order of Table.
constexpr std::array<StagingTable, kTables> kStagingTables = {{
    {"in_rows", nullptr, nullptr, nullptr},
    {"in_segments", "gyro text, axis text, log uuid, segment integer, file text, model text, metadata jsonb",
     "gyro, axis, log, segment, file, model, metadata",
     "INSERT INTO prism.segments (gyro, axis, log, segment, file, model, metadata) "
     "SELECT DISTINCT ON (gyro, axis, log, segment) * FROM in_segments ON CONFLICT DO NOTHING"},
    {"in_places",
     "gyro text, axis text, cursor text, log uuid, segment integer, row_number integer, arrival_s double precision, "
     "rows bigint",
     "gyro, axis, cursor, log, segment, row_number, arrival_s, rows",
     "INSERT INTO prism.places AS p (gyro, axis, cursor, log, segment, row_number, arrival, rows) "
     "SELECT gyro, axis, cursor, log, segment, row_number, to_timestamp(arrival_s), rows FROM in_places "
     "ON CONFLICT (gyro, axis) DO UPDATE SET cursor = excluded.cursor, log = coalesce(excluded.log, p.log), "
     "segment = coalesce(excluded.segment, p.segment), row_number = coalesce(excluded.row_number, p.row_number), "
     "arrival = coalesce(excluded.arrival, p.arrival), rows = p.rows + excluded.rows, updated = now()"},
    {"in_gaps", "gyro text, axis text, kind text, behind text, missing bigint", "gyro, axis, kind, behind, missing",
     "INSERT INTO prism.gaps (gyro, axis, kind, behind, missing) "
     "SELECT DISTINCT ON (gyro, axis, kind, behind) * FROM in_gaps ON CONFLICT DO NOTHING"},
    {"in_refused", "gyro text, axis text, log uuid, segment integer, row_number integer, why text, line text",
     "gyro, axis, log, segment, row_number, why, line",
     "INSERT INTO prism.refused_rows (gyro, axis, log, segment, row_number, why, line) SELECT * FROM in_refused "
     "ON CONFLICT DO NOTHING"},
    {"in_events", "gyro text, time_s double precision, severity text, kind text, text text",
     "gyro, time_s, severity, kind, text",
     "INSERT INTO prism.events (gyro, time, severity, kind, text) "
     "SELECT gyro, to_timestamp(time_s), severity, kind, text FROM in_events ON CONFLICT DO NOTHING"},
}};

constexpr const char* kCheckViolation = "23514";  // also: no partition for the row

// The data are the fault: data exception, integrity constraint violation, program limit exceeded (size of an index
// entry). Others, e.g. a full disk or an exception of a trigger (P0001), may end without a change of the data.
bool is_data_error(const std::string& sqlstate) {
  const std::string kind = sqlstate.substr(0, 2);
  return kind == "22" || kind == "23" || kind == "54";
}

Postgres::Deadline deadline() { return std::chrono::steady_clock::now() + RowDatabase::kTimeout; }

std::int64_t today() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::floor<std::chrono::days>(now).count();
}

template <class T>
tl::unexpected<Error> error_of(const Result<T>& result) {
  return tl::unexpected<Error>(result.error());
}

// in_rows has the columns of prism.rows, and the times as numbers.
std::string session_sql() {
  // COPY sends UTF-8, whatever the encoding of the database is. The timeouts end a session whose client is gone: it
  // would keep locks on the rows of prism.places.
  std::string sql =
      "SET client_encoding = 'UTF8'; SET idle_in_transaction_session_timeout = '30s'; SET tcp_keepalives_idle = 10; "
      "SET tcp_keepalives_interval = 5; "
      "SET tcp_keepalives_count = 3; SET synchronous_commit = on;"
      "CREATE TEMPORARY TABLE in_rows ON COMMIT DELETE ROWS AS SELECT *, 0::double precision AS arrival_s, "
      "0::double precision AS time_s FROM prism.rows LIMIT 0;";
  for (const StagingTable& staging : kStagingTables) {
    if (staging.definition != nullptr)
      sql += fmt::format("CREATE TEMPORARY TABLE {} ({}) ON COMMIT DELETE ROWS;", staging.table, staging.definition);
  }
  return sql;
}

std::string insert_rows() {
  const std::string columns = RowConverter::copy_columns();
  std::string names = columns;
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"arrival_s", "arrival"}, {"time_s", "time"}})
    names.replace(names.find(from), from.size(), to);
  std::string values = columns;
  for (const std::string name : {"arrival_s", "time_s"})
    values.replace(values.find(name), name.size(), "to_timestamp(" + name + ")");
  return fmt::format("INSERT INTO prism.rows ({}) SELECT {} FROM in_rows ON CONFLICT DO NOTHING", names, values);
}

}  // namespace

RowDatabase::RowDatabase(const PostgresSettings& settings, std::string site, std::function<void()> progress)
    : settings_(settings), site_(std::move(site)), progress_(std::move(progress)) {}

Postgres::Deadline RowDatabase::next_deadline() const {
  progress_();
  return deadline();
}

Result<void> RowDatabase::connect() {
  connection_.reset();
  auto opened = open_database(settings_, next_deadline());
  if (!opened) return error_of(opened);
  const auto version = schema_version(*opened, next_deadline());
  if (!version) return error_of(version);
  if (*version == -1) return make_error(kWhere, "has no schema prism; create it with prismrelay --init");
  if (*version != kSchemaVersion) return schema_version_error(*version);
  if (const auto done = opened->run(session_sql(), next_deadline()); !done) return error_of(done);
  const auto places =
      opened->run("SELECT gyro, axis, cursor FROM prism.places WHERE starts_with(gyro, $1) FOR UPDATE", {site_ + "/"},
                  next_deadline());  // FOR UPDATE waits for a commit of a previous connection
  if (!places) return error_of(places);
  cursors_.clear();
  for (int i = 0; i < PQntuples(places->get()); ++i)
    cursors_[{field(*places, i, 0), field(*places, i, 1)}] = field(*places, i, 2);
  connection_ = std::move(*opened);
  const auto days = read_days();
  if (!days) connection_.reset();
  return days;
}

Result<void> RowDatabase::read_days() {
  const auto days = connection_->run("SELECT day - '1970-01-01'::date FROM prism.days", next_deadline());
  if (!days) return error_of(days);
  days_.clear();
  for (int i = 0; i < PQntuples(days->get()); ++i) days_.insert(std::stoll(field(*days, i, 0)));
  return {};
}

std::string RowDatabase::stored_cursor(const LogKey& log) const {
  const auto found = cursors_.find(log);
  return found == cursors_.end() ? "" : found->second;
}

Result<std::vector<Refusal>> RowDatabase::commit(const Batch& batch) {
  days_are_new_ = false;
  const auto partitions = make_partitions(batch.days());
  auto refusals = partitions ? divided_commit(batch, [&](const CopyTexts& texts) { return try_to_store(batch, texts); })
                             : Result<std::vector<Refusal>>(error_of(partitions));
  if (!refusals) {
    connection_.reset();  // ends the transaction; connect() reads what was committed
    return refusals;
  }
  for (std::size_t i = 0; i < refusals->size(); ++i) {
    const BatchItem& item = batch.items()[i];
    if (!item.cursor.empty() && (*refusals)[i].error.empty()) cursors_[item.log] = item.cursor;
  }
  return refusals;
}

Result<std::optional<std::string>> RowDatabase::try_to_store(const Batch& batch, const CopyTexts& texts) {
  auto done = transact(texts);
  const auto is_refused = [&] { return !done && is_data_error(connection_->sqlstate()); };
  if (is_refused() && connection_->sqlstate() == kCheckViolation && !std::exchange(days_are_new_, true)) {
    // Another program may have dropped a partition: that is not a fault of the rows.
    if (const auto ended = connection_->run("ROLLBACK", next_deadline()); !ended) return error_of(ended);
    if (const auto read = read_days(); !read) return error_of(read);
    if (const auto made = make_partitions(batch.days()); !made) return error_of(made);
    done = transact(texts);
  }
  if (done) return std::nullopt;
  if (!is_refused()) return error_of(done);
  if (const auto ended = connection_->run("ROLLBACK", next_deadline()); !ended) return error_of(ended);
  return done.error().what;
}

Result<void> RowDatabase::ping() {
  if (const auto done = connection_->run("SELECT 1", next_deadline()); !done) {
    connection_.reset();
    return error_of(done);
  }
  return {};
}

// Separate transactions, because a new partition locks the table. The advisory lock serialises them over all relays.
Result<void> RowDatabase::make_partitions(const std::set<std::int64_t>& days) {
  for (const std::int64_t day : days) {
    if (days_.count(day) != 0) continue;
    const auto done = connection_->run(
        "BEGIN; SELECT pg_advisory_xact_lock(hashtext('prism.rows')); " + partition_sql(day) + "; COMMIT",
        next_deadline());
    if (!done) return error_of(done);
    const auto made = connection_->run("SELECT FROM prism.days WHERE day = '1970-01-01'::date + $1::integer",
                                       {std::to_string(day)}, next_deadline());
    if (!made) return error_of(made);
    if (PQntuples(made->get()) == 0)
      return make_error(kWhere, fmt::format("prism.{} exists, but is not a partition of prism.rows; rename or drop it",
                                            partition_name(day)));
    days_.insert(day);
  }
  return {};
}

Result<void> RowDatabase::transact(const CopyTexts& texts) {
  const auto until = next_deadline();
  static const std::string kInsertRows = insert_rows();
  if (const auto done = connection_->run("BEGIN", until); !done) return error_of(done);
  for (std::size_t i = 0; i < kTables; ++i) {
    const std::string& lines = texts[i];
    if (lines.empty()) continue;
    const bool is_rows = static_cast<Table>(i) == Table::kRows;
    const std::string columns = is_rows ? RowConverter::copy_columns() : kStagingTables[i].columns;
    auto copied = connection_->copy(
        fmt::format("COPY {} ({}) FROM STDIN (FORMAT csv)", kStagingTables[i].table, columns), lines, until);
    if (!copied) return copied;
    if (const auto done = connection_->run(is_rows ? kInsertRows : kStagingTables[i].insert, until); !done)
      return error_of(done);
  }
  if (const auto done = connection_->run("COMMIT", until); !done) return error_of(done);
  return {};
}

Result<std::vector<std::string>> RowDatabase::keep_days() {
  std::vector<std::string> dropped;
  const auto done = make_partitions({today(), today() + 1, today() + 2});
  if (!done) {
    connection_.reset();
    return error_of(done);
  }
  if (!settings_.keep_days) return dropped;
  const auto old = connection_->run(
      "SELECT day - '1970-01-01'::date, rows_about, pg_size_pretty(bytes) FROM prism.days "
      "WHERE day < (now() AT TIME ZONE 'UTC')::date - $1::integer ORDER BY day",
      {std::to_string(*settings_.keep_days)}, next_deadline());
  if (!old) return error_of(old);
  for (int i = 0; i < PQntuples(old->get()); ++i) {
    const std::int64_t day = std::stoll(field(*old, i, 0));
    if (const auto table = connection_->run("DROP TABLE prism." + partition_name(day), next_deadline()); !table)
      return error_of(table);
    days_.erase(day);
    dropped.push_back(fmt::format("dropped {} (about {} rows, {}): older than keep_days {}", partition_name(day),
                                  field(*old, i, 1), field(*old, i, 2), *settings_.keep_days));
  }
  return dropped;
}

}  // namespace prism::prismrelay
