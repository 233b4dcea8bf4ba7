// SPDX-License-Identifier: MIT
// What a person may set of prismrelay: read strictly from one JSON file (comments allowed).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace prism::prismrelay {

struct PostgresSettings {
  std::string connection;        ///< libpq's words: "host=/run/postgresql dbname=prism", or a postgresql:// address
  std::string password_file;     ///< path; empty: no password
  std::optional<int> keep_days;  ///< partitions of older days are dropped; absent: kept for ever
  std::string follower = "prismrelay";  ///< the name that prismd remembers the relay by
  double gather_s = 0.25;               ///< rows that came within this time are committed at once

  bool operator==(const PostgresSettings&) const = default;
};

struct MqttSettings {
  std::string host;
  int port = 1883;
  std::string user, password_file;
  std::string client_id;  ///< default: prismrelay-SITE
  std::string prefix = "prism";
  bool tls = false;  ///< preset port 8883
  std::string ca_file, cert_file, key_file;

  bool operator==(const MqttSettings&) const = default;
};

struct MetricsSettings {
  std::string file;  ///< of node_exporter's textfile folder, or one that a link there names
  double every_s = 15;

  bool operator==(const MetricsSettings&) const = default;
};

struct Settings {
  std::string path;  ///< the file it came from
  std::string site;  ///< gyros are SITE/NAME: the key in the table, and the topic
  /// Names (gyro1: /run/prismd/gyro1.sock), sockets, or folders (ending in '/') all of whose sockets are followed.
  std::vector<std::string> instances;
  std::string status_file;  ///< what `prismrelay --status` reads; its folder must be there
  std::optional<PostgresSettings> postgresql;
  std::optional<MqttSettings> mqtt;
  std::optional<MetricsSettings> metrics;

  bool operator==(const Settings&) const = default;
};

/// The status file of this user: $RUNTIME_DIRECTORY/status.json under systemd, /run/prismrelay/status.json for root,
/// else in the user's own runtime folder.
std::string default_status_file();

/// Every refusal: file:/pointer: found, expected.
Result<Settings> parse_settings(std::string_view text, const std::string& path);
Result<Settings> load_settings(const std::string& path);

/// The first line of a password file; refused where it is not there, empty, or readable by everybody.
Result<std::string> read_password(const std::string& path);

}  // namespace prism::prismrelay
