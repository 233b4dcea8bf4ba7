// SPDX-License-Identifier: MIT
// An SQLite file, locked by this process.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "base/result.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace prism::prismweb {

/// Adds two SQL functions. `crc(a, …)` returns the CRC-32 of its arguments. `checked(crc, a, …)` returns `a`, or fails
/// if the CRC does not match: the file is then damaged.
class Database {
 public:
  using Value = std::variant<std::int64_t, double, std::string>;  ///< NaN is stored as NULL

  /// One row of a result, valid during the call of TakeRow.
  class Row {
   public:
    explicit Row(sqlite3_stmt* statement) : statement_(statement) {}
    std::int64_t integer(int column) const;
    double number(int column) const;  ///< NaN for NULL
    std::string text(int column) const;

   private:
    sqlite3_stmt* statement_;
  };
  using TakeRow = std::function<void(const Row& row)>;

  /// Opens or creates the file, checks its structure, and locks it until destruction. From then on, each page that is
  /// read again must be unchanged (page_check.hpp).
  Result<void> open(const std::string& path);

  /// Runs one statement with a value for each `?`. Errors: the path and the reason of the disk or of SQLite.
  Result<void> run(const std::string& sql, const std::vector<Value>& values = {}, const TakeRow& take = nullptr);

  /// Rolls back the transaction, unless its error already did.
  void roll_back();

  /// True after an error that shows that the file was changed or corrupted since it was written.
  bool is_damaged() const { return is_damaged_; }

 private:
  struct Close {
    void operator()(sqlite3* database) const;
    void operator()(sqlite3_stmt* statement) const;
  };

  tl::unexpected<Error> make_error();

  std::string path_;
  bool is_damaged_ = false;
  std::unique_ptr<sqlite3, Close> database_;
  std::map<std::string, std::unique_ptr<sqlite3_stmt, Close>> statements_;  ///< by SQL text
};

}  // namespace prism::prismweb
