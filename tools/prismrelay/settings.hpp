// SPDX-License-Identifier: MIT
// Configuration of prismrelay: one JSON file (comments allowed); unknown keys are errors.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_document.hpp"
#include "base/result.hpp"

namespace prism::prismrelay {

struct PostgresSettings {
  std::string connection;        ///< for libpq: "host=/run/postgresql dbname=prism", or a postgresql:// URI
  std::string password_file;     ///< path; empty: no password
  std::optional<int> keep_days;  ///< older partitions are dropped; absent: no limit
  double gather_s = 0.25;        ///< rows within this time are committed together
};

struct TlsFiles {
  std::string ca, certificate, key;  ///< the last two: empty without a client certificate
};

struct MqttSettings {
  std::string host;
  int port = 1883;
  std::string user, password_file;
  std::string client_id;  ///< default: prismrelay-SITE
  std::string prefix = "prism";
  std::optional<TlsFiles> tls = std::nullopt;  ///< then the default port is 8883
};

struct Settings {
  std::string path;  ///< of the configuration
  std::string site;  ///< gyros are SITE/NAME in tables and topics
  /// Names (gyro1: /run/prismd/gyro1.sock), sockets, or directories (ending in '/') for all their sockets.
  std::vector<std::string> instances;
  std::string status_file;  ///< `prismrelay --status` reads it; its directory must exist
  std::optional<PostgresSettings> postgresql;
  std::optional<MqttSettings> mqtt;
  std::vector<std::string> warnings;  ///< one per key that has no effect any more
};

/// Errors have the form file:/pointer: found, expected.
Result<Settings> parse_settings(std::string_view text, const std::string& path);
Result<Settings> load_settings(const std::string& path);
/// JSON Schema of the configuration.
Json settings_schema();

/// Returns the first line of a password file. Errors: unreadable, empty, or readable by other users.
Result<std::string> read_password(const std::string& path);

}  // namespace prism::prismrelay
