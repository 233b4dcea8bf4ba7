// SPDX-License-Identifier: MIT
#include "tools/prismweb/database.hpp"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <boost/crc.hpp>
#include <cerrno>
#include <cstring>
#include <limits>
#include <span>

#include "tools/prismweb/page_check.hpp"

namespace prism::prismweb {
namespace {

using Arguments = std::span<sqlite3_value*>;

// −0 and 0 get the same CRC, because SQLite stores a double without a fraction as an integer.
std::uint32_t crc_of(Arguments values) {
  boost::crc_32_type crc;
  for (sqlite3_value* const value : values) {
    if (sqlite3_value_type(value) == SQLITE_TEXT) {
      crc.process_bytes(sqlite3_value_text(value), static_cast<std::size_t>(sqlite3_value_bytes(value)) + 1);
    } else {
      const bool is_known = sqlite3_value_type(value) != SQLITE_NULL;
      const double number = is_known ? sqlite3_value_double(value) + 0.0 : std::numeric_limits<double>::quiet_NaN();
      crc.process_bytes(&number, sizeof number);
    }
  }
  return crc.checksum();
}

Arguments arguments(int count, sqlite3_value** values) { return {values, static_cast<std::size_t>(count)}; }

void crc(sqlite3_context* context, int count, sqlite3_value** values) {
  sqlite3_result_int64(context, crc_of(arguments(count, values)));
}

void checked(sqlite3_context* context, int count, sqlite3_value** values) {
  if (sqlite3_value_int64(values[0]) == crc_of(arguments(count, values).subspan(1)))
    return sqlite3_result_value(context, values[1]);
  sqlite3_result_error(context, "a record is damaged", -1);
  sqlite3_result_error_code(context, SQLITE_CORRUPT);
}

// SQLite opens a file that it cannot create once more, to read it, and reports the second error, ENOENT. Returns the
// disk's reason, such as ENOSPC without a free inode: that of another new file in the directory.
int reason_not_created(const std::string& path) {
  const std::string probe = path + "-probe";
  const int file = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (file < 0) return errno == EEXIST ? ENOENT : errno;
  ::close(file);
  ::unlink(probe.c_str());
  return ENOENT;
}

struct Bind {
  sqlite3_stmt* statement;
  int index;
  void operator()(std::int64_t value) const { sqlite3_bind_int64(statement, index, value); }
  void operator()(double value) const { sqlite3_bind_double(statement, index, value); }
  void operator()(const std::string& value) const {
    sqlite3_bind_text(statement, index, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT);
  }
};

}  // namespace

void Database::Close::operator()(sqlite3* database) const { sqlite3_close_v2(database); }
void Database::Close::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

std::int64_t Database::Row::integer(int column) const { return sqlite3_column_int64(statement_, column); }

double Database::Row::number(int column) const {
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::numeric_limits<double>::quiet_NaN();
  return sqlite3_column_double(statement_, column);
}

std::string Database::Row::text(int column) const {
  const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return text == nullptr ? "" : text;
}

// sqlite3_system_errno() has no reason for a commit. SQLITE_ERROR and SQLITE_READONLY mean
// that another program changed the schema or the mode of the file.
tl::unexpected<Error> Database::make_error() {
  int cause = disk_errno();
  const int code = sqlite3_errcode(database_.get());
  is_damaged_ = code == SQLITE_CORRUPT || code == SQLITE_NOTADB || code == SQLITE_ERROR || code == SQLITE_READONLY;
  if (code == SQLITE_BUSY) return prism::make_error(path_, "is in use by another process");
  if (code == SQLITE_FULL) return prism::make_error(path_, std::strerror(ENOSPC));
  if (code == SQLITE_CANTOPEN && cause == ENOENT) cause = reason_not_created(path_);
  const bool by_disk = (code == SQLITE_IOERR || code == SQLITE_CANTOPEN) && cause != 0;
  return prism::make_error(path_, by_disk ? std::strerror(cause) : sqlite3_errmsg(database_.get()));
}

// With an exclusive lock, WAL needs no shared memory, and two processes cannot count the same rows twice.
Result<void> Database::open(const std::string& path) {
  path_ = path;
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOFOLLOW | SQLITE_OPEN_NOMUTEX;
  disk_errno() = 0;
  const int code = sqlite3_open_v2(path.c_str(), &opened, flags, page_check_vfs());
  database_.reset(opened);
  if (code != SQLITE_OK) return make_error();
  const int pure = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_DIRECTONLY;
  sqlite3_create_function(opened, "crc", -1, pure, nullptr, crc, nullptr, nullptr);
  sqlite3_create_function(opened, "checked", -1, pure, nullptr, checked, nullptr, nullptr);
  for (const char* const setting : {"locking_mode = EXCLUSIVE", "journal_mode = WAL", "wal_autocheckpoint = 100",
                                    "cache_size = -256", "trusted_schema = OFF"}) {
    if (Result<void> done = run(std::string("PRAGMA ") + setting); !done) return done;
  }
  std::string found;
  Result<void> done = run("PRAGMA quick_check(1)", {}, [&](const Row& row) { found = row.text(0); });
  is_damaged_ = is_damaged_ || (done && found != "ok");
  // The first line only names the database.
  return done && is_damaged_ ? prism::make_error(path_, "found damage: " + found.substr(found.rfind('\n') + 1)) : done;
}

void Database::roll_back() {
  if (sqlite3_get_autocommit(database_.get()) == 0) (void)run("ROLLBACK");
}

Result<void> Database::run(const std::string& sql, const std::vector<Value>& values, const TakeRow& take) {
  disk_errno() = 0;
  auto& statement = statements_[sql];
  if (!statement) {
    sqlite3_stmt* prepared = nullptr;
    if (sqlite3_prepare_v3(database_.get(), sql.c_str(), -1, SQLITE_PREPARE_PERSISTENT, &prepared, nullptr) !=
        SQLITE_OK)
      return make_error();
    statement.reset(prepared);
  }
  for (std::size_t i = 0; i < values.size(); ++i) std::visit(Bind{statement.get(), static_cast<int>(i) + 1}, values[i]);
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(statement.get())) == SQLITE_ROW) {
    if (take) take(Row(statement.get()));
  }
  Result<void> done = code == SQLITE_DONE ? Result<void>() : make_error();
  sqlite3_reset(statement.get());
  return done;
}

}  // namespace prism::prismweb
