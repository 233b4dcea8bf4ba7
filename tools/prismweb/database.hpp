// SPDX-License-Identifier: MIT
// One SQLite file that this process alone uses.
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

/// SQL has two more functions here: `crc(a, …)` is the CRC-32 of its arguments. `checked(crc, a, …)` returns `a`; if
/// the CRC is another one it fails, and the file is damaged.
class Database {
 public:
  using Value = std::variant<std::int64_t, double, std::string>;  ///< NaN is stored as NULL

  /// One row of a result; valid during the call that it is given to.
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

  /// Opens or creates the file and checks its structure. It is in use by this process until the object is destroyed.
  Result<void> open(const std::string& path);

  /// Runs one statement with a value for each `?`. Errors: the path, and the disk's reason or SQLite's.
  Result<void> run(const std::string& sql, const std::vector<Value>& values = {}, const TakeRow& take = nullptr);

  /// Ends a transaction without effect, unless its error has done so.
  void roll_back();

  /// True after an error that means that the file does not contain what was written.
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
  std::map<std::string, std::unique_ptr<sqlite3_stmt, Close>> statements_;  ///< by their text
};

}  // namespace prism::prismweb
