// SPDX-License-Identifier: MIT
#include "tools/prismweb/settings.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/json_table.hpp"
#include "base/time_scale.hpp"
#include "config/search_path.hpp"
#include "config/version.hpp"
#include "tools/client/instances.hpp"
#include "tools/command_line.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDygraphs = "/usr/share/javascript/dygraphs";

// The directory from systemd, else in the user's cache.
std::string default_state() {
  if (const char* made = std::getenv("STATE_DIRECTORY"); made != nullptr && *made != '\0') return made;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return std::string(cache) + "/prismweb";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home != '\0' ? std::string(home) + "/.cache/prismweb" : "";
}

// nullopt if it is not an IP address.
std::optional<bool> is_loopback(const std::string& address) {
  in_addr v4{};
  in6_addr v6{};
  if (::inet_pton(AF_INET, address.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  if (::inet_pton(AF_INET6, address.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6);
  return std::nullopt;
}

JsonTable<Settings> keys() {
  using S = Settings;
  return JsonTable<S>()
      .custom(
          "$schema", {{"type", "string"}}, "", [](const Section& section, S&) { section.any("$schema"); }, nullptr)
      .custom(
          "listen", {{"type", "string"}, {"pattern", "^([0-9.]+|\\[[0-9a-fA-F:.]+\\]):[0-9]+$"}}, "",
          [](const Section& section, S& settings) {
            if (!section.has("listen")) return;
            const std::string listen = section.text("listen");
            if (const auto parsed = parse_listen(listen, settings); !parsed)
              section.fail("listen", parsed.error().what);
          },
          nullptr)
      .custom(
          "socket", {{"type", "string"}, {"minLength", 1}},
          "As the options; at most one. Default: listen 127.0.0.1:8467.",
          [](const Section& section, S& settings) {
            if (!section.has("socket")) return;
            if (section.has("listen")) section.fail("socket", "conflicts with \"listen\"; use one of them");
            settings.unix_socket = section.text("socket");
            settings.address.clear();
            if (settings.unix_socket.empty()) section.fail("socket", "found \"\", expected a path");
          },
          nullptr)
      .texts(
          "hosts", &S::hosts,
          "One or more names of this server, in addition to localhost, 127.0.0.1, [::1] and the address listened on. "
          "A request with another Host is rejected (421), so that pages of other sites cannot access the gyros (DNS "
          "rebinding).")
      .texts("instances", &S::instances, "")
      .text("page", &S::page, "")
      .text("state", &S::state, "As the options.")
      .text("dygraphs", &S::dygraphs, "Directory of Debian's libjs-dygraphs. Default: /usr/share/javascript/dygraphs.");
}

}  // namespace

Result<void> parse_listen(std::string_view text, Settings& settings) {
  const auto wrong = make_error("", fmt::format("found {}, expected ADDRESS:PORT, such as \"127.0.0.1:8467\" or "
                                                "\"[::1]:8467\"",
                                                shown(Json(std::string(text)))));
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return wrong;
  std::string_view address = text.substr(0, colon);
  const std::string_view port = text.substr(colon + 1);
  if (address.starts_with('[') != address.ends_with(']')) return wrong;
  const bool bracketed = address.starts_with('[');
  if (bracketed) address = address.substr(1, address.size() - 2);
  const std::optional<bool> loopback = is_loopback(std::string(address));
  if (bracketed != (address.find(':') != std::string_view::npos) || !loopback) return wrong;
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (port.empty() || end != port.data() + port.size()) return wrong;
  if (error == std::errc::result_out_of_range)
    return make_error("", fmt::format("found the port {}, expected at most 65535", shown(Json(std::string(port)))));
  if (error != std::errc()) return wrong;
  if (!*loopback)
    return make_error("", fmt::format("found {}, expected a loopback address; let nginx or caddy serve other hosts "
                                      "(page.md, \"Other hosts\")",
                                      address));
  settings.address = address;
  settings.port = number;
  settings.unix_socket.clear();
  return {};
}

Result<void> parse_web_config(std::string_view text, const std::string& path, Settings& settings) {
  const Result<JsonDocument> document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  std::error_code error;
  const fs::path base = fs::absolute(path, error).parent_path();
  const Section section(*document);
  settings.warnings = section.removed(KeyFile::kWeb);
  keys().read(section, settings);
  if (const auto wrong = client::instances_error(settings.instances)) section.fail("instances", *wrong);
  for (auto& [key, file] : {std::pair("socket", &settings.unix_socket), std::pair("page", &settings.page),
                            std::pair("dygraphs", &settings.dygraphs), std::pair("state", &settings.state)}) {
    if (section.has(key) && !file->empty()) *file = (base / *file).lexically_normal().string();
  }
  return section.finish();
}

Json web_config_schema() { return schema_of_file("prismweb", "tools/prismweb/settings.cpp", keys().schema()); }

std::optional<int> parse_options(int argc, char** argv, Settings& settings) {
  CLI::App app("prismweb: serves a web page and an API for the gyros of this host");
  tools::use_readable_help(app);
  std::string config, listen, socket, page, state;
  std::vector<std::string> instances;
  bool check = false;
  app.set_version_flag("--version", std::string("prismweb ") + kVersion);
  app.add_option("--config", config, "configuration file, see prismweb(8)")->type_name("FILE");
  app.add_flag("--check", check, "check the configuration, then exit (0 valid, 78 invalid)");
  app.add_option("--listen", listen, "loopback address to listen on (default: 127.0.0.1:8467); port 0: any free port")
      ->type_name("ADDRESS:PORT");
  app.add_option("--socket", socket, "listen on a Unix socket instead, for a proxy")->type_name("PATH");
  app.add_option("--instance", instances,
                 "instance name or socket path; may be repeated (default: all instances of the host)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAME|PATH");
  app.add_option("--page", page, "directory of the page's files (default: the installed ones)")->type_name("FOLDER");
  app.add_option("--state", state, "directory for minutes and hours of long views (default: ~/.cache/prismweb)")
      ->type_name("FOLDER");
  tools::add_examples(app, {"prismweb", "prismweb --instance gyro1 --state ~/.cache/prismweb",
                            "prismweb --config /etc/prism/web.json --check"});
  const auto exit_with = [](int code, const std::string& what) {
    fmt::print(stderr, "prismweb: {}\n", what);
    return code;
  };
  if (const auto code = tools::parse(app, "prismweb", argc, argv)) return code;
  settings.page = config::data_places("page", "").back().string();
  settings.dygraphs = kDygraphs;
  settings.state = default_state();
  if (!config.empty()) {
    const Result<std::string> text = read_text_file(config);
    const Result<void> read =
        text ? parse_web_config(*text, config, settings) : Result<void>(tl::unexpect, text.error());
    if (!read) return exit_with(kExitConfig, read.error().text());
  }
  if (!listen.empty()) {
    const Result<void> parsed = parse_listen(listen, settings);
    if (!parsed) return exit_with(kExitUsage, "--listen: " + parsed.error().what);
  }
  if (!socket.empty()) {
    settings.address.clear();
    settings.unix_socket = socket;
  }
  if (!instances.empty()) settings.instances = instances;
  if (!page.empty()) settings.page = page;
  if (!state.empty()) settings.state = state;
  if (const auto scale = check_time_scale(); !scale) return exit_with(kExitConfig, scale.error().text());
  for (const std::string& warning : settings.warnings) fmt::print(stderr, "prismweb: warning: {}\n", warning);
  if (!check) return std::nullopt;
  fmt::print("prismweb: good: {}\n", settings.unix_socket.empty() ? settings.address : settings.unix_socket);
  return kExitDone;
}

}  // namespace prism::prismweb
