// SPDX-License-Identifier: MIT
#include "tools/prismrelay/schema_init.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <cstdlib>
#include <utility>

#include "tools/prismrelay/schema.hpp"
#include "tools/prismrelay/schema_check.hpp"

namespace prism::prismrelay {
namespace {

constexpr const char* kDatabase = "postgresql";
constexpr std::chrono::seconds kInitTimeout{60};  // another --init, or an index of a large table

}  // namespace

Result<Postgres> open_database(const PostgresSettings& settings, Postgres::Deadline until) {
  std::string password;
  if (!settings.password_file.empty()) {
    auto read = read_password(settings.password_file);
    if (!read) return tl::unexpected<Error>(read.error());
    password = std::move(*read);
  }
  return Postgres::open(settings.connection, password, until);
}

Result<int> schema_version(Postgres& connection, Postgres::Deadline until) {
  const auto table = connection.run("SELECT to_regclass('prism.version')", until);
  if (!table) return tl::unexpected<Error>(table.error());
  if (field(*table, 0, 0).empty()) return -1;
  const auto version = connection.run("SELECT max(version) FROM prism.version", until);
  if (!version) return tl::unexpected<Error>(version.error());
  const std::string text = field(*version, 0, 0);
  return text.empty() ? 0 : std::atoi(text.c_str());
}

tl::unexpected<Error> schema_version_error(int found) {
  return make_error(kDatabase,
                    fmt::format("found version {} of the schema prism, expected {}: {}", found, kSchemaVersion,
                                found > kSchemaVersion ? "created by a later prismrelay"
                                                       : "created by an earlier one, or by an incomplete --init"));
}

Result<std::string> init_schema(const PostgresSettings& settings) {
  const auto until = std::chrono::steady_clock::now() + kInitTimeout;
  auto connection = open_database(settings, until);
  if (!connection) return tl::unexpected<Error>(connection.error());
  const auto run = [&](const std::string& sql) -> Result<void> {
    if (const auto done = connection->run(sql, until); !done) return tl::unexpected<Error>(done.error());
    return {};
  };
  if (auto locked = run("BEGIN; SELECT pg_advisory_xact_lock(hashtext('prism.version'))"); !locked)
    return tl::unexpected<Error>(locked.error());
  const auto version = schema_version(*connection, until);
  if (!version) return tl::unexpected<Error>(version.error());
  if (*version > 0 && *version != kSchemaVersion) return schema_version_error(*version);
  auto check = check_schema(*connection, until);
  if (!check) return tl::unexpected<Error>(check.error());
  if (!check->differences.empty())
    return make_error(kDatabase, fmt::format("the schema prism differs from version {}: {}", kSchemaVersion,
                                             fmt::join(check->differences, "; ")));
  if (*version == 0) check->missing.insert(check->missing.begin(), "row of version");
  if (check->missing.empty()) return fmt::format("schema prism exists, version {}", kSchemaVersion);
  for (const std::string& statement : check->statements) {
    if (const auto done = run(statement); !done)
      return make_error(kDatabase, fmt::format("{}: {}", statement, done.error().what));
  }
  if (const auto done = run(schema_sql()); !done) return tl::unexpected<Error>(done.error());  // with COMMIT
  if (check->is_empty) return fmt::format("created schema prism, version {}", kSchemaVersion);
  return fmt::format("completed schema prism, version {}: created {}", kSchemaVersion, fmt::join(check->missing, ", "));
}

}  // namespace prism::prismrelay
