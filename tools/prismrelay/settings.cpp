// SPDX-License-Identifier: MIT
#include "tools/prismrelay/settings.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/json_table.hpp"
#include "config/socket_path.hpp"
#include "tools/client/instances.hpp"
#include "tools/prismrelay/mqtt.hpp"

namespace prism::prismrelay {
namespace {

namespace fs = std::filesystem;

// The text is a level of topics, and in keys it precedes a '/'.
void check_topic_part(const Section& section, const char* key, const std::string& text) {
  if (text.size() > 64 || !is_topic_part(text) || text.find(' ') != std::string::npos)
    section.fail(key, fmt::format("found \"{}\", expected 1 to 64 printable characters without blanks, /, + and #, "
                                  "without a . or $ first",
                                  shortened(text)));
}

const Json kNotEmpty = {{"minLength", 1}};
const Json kTopicPart = {{"minLength", 1}, {"maxLength", 64}, {"pattern", "^[^/+# ]+$"}};

JsonTable<PostgresSettings> postgresql_keys() {
  using P = PostgresSettings;
  return JsonTable<P>()
      .text("connection", &P::connection,
            {kRequired, "As libpq takes it, without a password: host=/run/postgresql dbname=prism."})
      .text("password_file", &P::password_file,
            "Its first line is the password; only the owner may read it. Without a / it is in "
            "/etc/prism/credentials, readable only by root: systemd passes it.")
      .integer("keep_days", {1, 36500}, &P::keep_days, "Older days of arrival are deleted and reported. Default: none.")
      .number("gather_s", {0.01, 10}, &P::gather_s, "Rows within this time are committed together.")
      .then([](const Section& section, P& settings) {
        if (settings.connection.find("password=") != std::string::npos)
          section.fail("connection", "contains a password; put it in the file named by password_file");
      });
}

JsonTable<TlsFiles> tls_keys() {
  using T = TlsFiles;
  return JsonTable<T>()
      .text("ca_file", &T::ca, "CA certificate that verifies the broker.")
      .also(kNotEmpty, true)
      .text("cert_file", &T::certificate, "")
      .text("key_file", &T::key, "Client certificate and its key, if the broker requires one.")
      .then([](const Section& section, T& files) {
        if (files.ca.empty())
          section.fail("ca_file", "is missing, expected the CA certificate that verifies the broker");
        if (files.certificate.empty() != files.key.empty())
          section.fail("key_file", "found one of cert_file and key_file, expected both or neither");
      });
}

JsonTable<MqttSettings> mqtt_keys() {
  using M = MqttSettings;
  return JsonTable<M>()
      .text("host", &M::host, {kRequired, "The broker's host name."})
      .also(kNotEmpty)
      .integer("port", {1, 65535}, &M::port, "With tls the default is 8883.")
      .text("user", &M::user, "")
      .text("password_file", &M::password_file, "For a broker with users; as that of the database.")
      .text("client_id", &M::client_id, "Default: prismrelay-SITE.")
      .text("prefix", &M::prefix, "First part of every topic.")
      .also(kTopicPart)
      .object("tls", tls_keys(), &M::tls, "")
      .then([](const Section& section, M& settings) {
        if (settings.host.empty()) section.fail("host", "is empty, expected the broker's host name");
        if (settings.tls && !section.has("port")) settings.port = 8883;
        if (!settings.password_file.empty() && settings.user.empty()) section.fail("password_file", "requires user");
        check_topic_part(section, "prefix", settings.prefix);
      });
}

JsonTable<Settings> keys() {
  using S = Settings;
  return JsonTable<S>()
      .custom(
          "$schema", {{"type", "string"}}, "", [](const Section& section, S&) { section.any("$schema"); }, nullptr)
      .text("site", &S::site,
            {kRequired,
             "Name of this host, different for each host: gyros are SITE/NAME in tables and topics. 1 to 64 printable "
             "characters without blanks, /, + and #, without a . or $ first."})
      .also(kTopicPart)
      .texts(
          "instances", &S::instances,
          "One or several: a name, found as by prismctl(1) (in /run/prismd, then $XDG_RUNTIME_DIR/prismd), a socket, "
          "or a directory, ending in /, for all its sockets. A name is 1 to 90 bytes of printable UTF-8, without a . "
          "or blank first or a blank last. An invalid name in a directory is skipped and logged once. Default: "
          "/run/prismd/.")
      .text("status_file", &S::status_file,
            "File that --status reads, and prismctl metrics at its default: /run/prismrelay/status.json for the "
            "service and root, else $XDG_RUNTIME_DIR/prismrelay.json.")
      .object("postgresql", postgresql_keys(), &S::postgresql, "")
      .object("mqtt", mqtt_keys(), &S::mqtt, "")
      .then([](const Section& top, S& settings) {
        check_topic_part(top, "site", settings.site);
        if (const auto wrong = client::instances_error(settings.instances)) top.fail("instances", *wrong);
        if (top.good() && !settings.postgresql && !settings.mqtt)
          top.fail("", "has no target, expected postgresql or mqtt");
      });
}

void find_files(Settings& settings, const fs::path& base) {
  const auto find = [&](std::string& file) {
    if (!file.empty()) file = (base / file).lexically_normal().string();
  };
  // A name without '/' is a systemd credential (LoadCredential=relay:DIRECTORY gives relay_NAME) if that exists, else a
  // file next to the configuration.
  const auto find_secret = [&](std::string& name) {
    const char* const credentials = std::getenv("CREDENTIALS_DIRECTORY");
    std::error_code error;
    if (!name.empty() && name.find('/') == std::string::npos && credentials != nullptr) {
      const fs::path path = fs::path(credentials) / ("relay_" + name);
      if (fs::exists(path, error)) name = path.string();
    }
    find(name);
  };
  const std::vector<std::string> usual = config::relay_status_files();  // the last one: of the user
  if (settings.status_file.empty()) settings.status_file = ::geteuid() == 0 ? usual.front() : usual.back();
  find(settings.status_file);
  if (settings.postgresql) find_secret(settings.postgresql->password_file);
  if (!settings.mqtt) return;
  find_secret(settings.mqtt->password_file);
  if (!settings.mqtt->tls) return;
  for (std::string TlsFiles::*file : {&TlsFiles::ca, &TlsFiles::certificate, &TlsFiles::key})
    find((*settings.mqtt->tls).*file);
}

}  // namespace

Result<Settings> parse_settings(std::string_view text, const std::string& path) {
  const auto document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  const Section top(*document);
  Settings settings;
  settings.path = path;
  settings.warnings = top.removed(KeyFile::kRelay);
  keys().read(top, settings);
  if (const auto done = top.finish(); !done) return tl::unexpected<Error>(done.error());
  if (settings.instances.empty()) settings.instances = {"/run/prismd/"};
  if (settings.mqtt && settings.mqtt->client_id.empty()) settings.mqtt->client_id = "prismrelay-" + settings.site;
  find_files(settings, fs::absolute(path).parent_path());
  return settings;
}

Json settings_schema() { return schema_of_file("prismrelay", "tools/prismrelay/settings.cpp", keys().schema()); }

Result<Settings> load_settings(const std::string& path) {
  return read_text_file(path).and_then([&](const std::string& text) { return parse_settings(text, path); });
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
