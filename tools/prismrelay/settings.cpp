// SPDX-License-Identifier: MIT
#include "tools/prismrelay/settings.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <set>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/outside_text.hpp"
#include "config/socket_path.hpp"

namespace prism::prismrelay {
namespace {

namespace fs = std::filesystem;

// A name without '/' is a systemd credential (LoadCredential=relay:DIRECTORY gives relay_NAME) if that exists, else a
// file next to the configuration.
std::string secret_path(const std::string& name, const fs::path& base) {
  if (name.empty()) return "";
  const char* const credentials = std::getenv("CREDENTIALS_DIRECTORY");
  if (name.find('/') == std::string::npos && credentials != nullptr) {
    const fs::path path = fs::path(credentials) / ("relay_" + name);
    std::error_code error;
    if (fs::exists(path, error)) return path.string();
  }
  return (base / name).lexically_normal().string();
}

std::string path_of(const std::string& text, const fs::path& base) {
  return text.empty() ? text : (base / text).lexically_normal().string();
}

// The text is a level of topics, and in keys it precedes a '/'.
void check_topic_part(const Section& section, const char* key, const std::string& text) {
  if (text.size() > 64 || !follows(TextRule::kName, text) || text.find_first_of(" +#") != std::string::npos ||
      text.starts_with('$'))
    section.fail(key, fmt::format("found \"{}\", expected 1 to 64 printable characters without blanks, /, + and #, "
                                  "without a . or $ first",
                                  shortened(text)));
}

PostgresSettings read_postgresql(const Section& section, const fs::path& base) {
  PostgresSettings settings;
  settings.connection = section.text("connection");
  if (settings.connection.find("password=") != std::string::npos)
    section.fail("connection", "contains a password; put it in the file named by password_file");
  settings.password_file = secret_path(section.text("password_file", ""), base);
  if (section.has("keep_days")) settings.keep_days = static_cast<int>(section.integer("keep_days", {1, 36500}));
  settings.gather_s = section.number("gather_s", {0.01, 10}, settings.gather_s);
  return settings;
}

void read_tls(const Section& section, const fs::path& base, MqttSettings& settings) {
  settings.tls = true;
  settings.port = 8883;
  settings.ca_file = path_of(section.text("ca_file", ""), base);
  settings.cert_file = path_of(section.text("cert_file", ""), base);
  settings.key_file = path_of(section.text("key_file", ""), base);
  if (settings.ca_file.empty())
    section.fail("ca_file", "is missing, expected the CA certificate that verifies the broker");
  if (settings.cert_file.empty() != settings.key_file.empty())
    section.fail("key_file", "found one of cert_file and key_file, expected both or neither");
}

MqttSettings read_mqtt(const Section& section, const fs::path& base, const std::string& site) {
  MqttSettings settings;
  settings.host = section.text("host");
  if (settings.host.empty()) section.fail("host", "is empty, expected the broker's host name");
  if (section.has("tls")) read_tls(section.object("tls"), base, settings);
  settings.port = static_cast<int>(section.integer("port", {1, 65535}, settings.port));
  settings.user = section.text("user", "");
  settings.password_file = secret_path(section.text("password_file", ""), base);
  if (!settings.password_file.empty() && settings.user.empty()) section.fail("password_file", "requires user");
  settings.client_id = section.text("client_id", "prismrelay-" + site);
  settings.prefix = section.text("prefix", settings.prefix);
  check_topic_part(section, "prefix", settings.prefix);
  return settings;
}

MetricsSettings read_metrics(const Section& section, const fs::path& base) {
  MetricsSettings settings;
  settings.file = path_of(section.text("file", ""), base);
  if (fs::path(settings.file).extension() != ".prom")
    section.fail("file", fmt::format("found \"{}\", expected a path that ends in .prom", settings.file));
  settings.every_s = section.number("every_s", {1, 3600}, settings.every_s);
  return settings;
}

void check_instances(const Section& top, const std::vector<std::string>& instances) {
  std::set<std::string> names;
  for (const std::string& entry : instances) {
    if (entry.empty())
      return top.fail("instances", "contains an empty string, expected names, sockets or directories/");
    if (entry.back() == '/') continue;
    if (const std::string name = config::instance_name(entry); !follows(TextRule::kName, name))
      return top.fail("instances",
                      fmt::format("found \"{}\", expected a name of {}", shortened(name), rule_text(TextRule::kName)));
    if (!names.insert(fs::path(entry).stem().string()).second)
      return top.fail("instances", fmt::format("found \"{}\" twice", fs::path(entry).stem().string()));
  }
}

}  // namespace

std::string default_status_file() {
  const auto variable = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  if (const std::string directory = variable("RUNTIME_DIRECTORY"); !directory.empty())
    return directory + "/status.json";
  const std::string user = variable("XDG_RUNTIME_DIR");
  if (::geteuid() == 0 || user.empty()) return "/run/prismrelay/status.json";
  return user + "/prismrelay.json";
}

Result<Settings> parse_settings(std::string_view text, const std::string& path) {
  const auto document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  const Section top(*document);
  const fs::path base = fs::absolute(path).parent_path();
  Settings settings;
  settings.path = path;
  settings.warnings = top.removed(KeyFile::kRelay);
  top.text("$schema", "");
  settings.site = top.text("site");
  check_topic_part(top, "site", settings.site);
  settings.instances = top.texts("instances", false);
  check_instances(top, settings.instances);
  if (settings.instances.empty()) settings.instances = {"/run/prismd/"};
  settings.status_file = path_of(top.text("status_file", ""), base);
  if (settings.status_file.empty()) settings.status_file = default_status_file();
  if (top.has("postgresql")) settings.postgresql = read_postgresql(top.object("postgresql"), base);
  if (top.has("mqtt")) settings.mqtt = read_mqtt(top.object("mqtt"), base, settings.site);
  if (top.has("metrics")) settings.metrics = read_metrics(top.object("metrics"), base);
  if (top.good() && !settings.postgresql && !settings.mqtt && !settings.metrics)
    top.fail("", "has no target, expected postgresql, mqtt or metrics");
  if (const auto done = top.finish(); !done) return tl::unexpected<Error>(done.error());
  return settings;
}

Result<Settings> load_settings(const std::string& path) {
  const auto text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_settings(*text, path);
}

Result<std::string> read_password(const std::string& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) == 0 && (file.st_mode & S_IROTH) != 0)
    return make_error(path,
                      fmt::format("readable by all users (mode {:04o}), expected 0600 or 0640", file.st_mode & 07777));
  const auto text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  std::string password = text->substr(0, text->find_first_of("\r\n"));
  if (password.empty()) return make_error(path, "is empty, expected a password in its first line");
  return password;
}

}  // namespace prism::prismrelay
