// SPDX-License-Identifier: MIT
#include "tools/prismweb/web_config.hpp"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <utility>

#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/json_table.hpp"
#include "tools/prismweb/access.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;

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
  const Result<bool> loopback = is_loopback(std::string(address));
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
  for (auto& [key, file] : {std::pair("socket", &settings.unix_socket), std::pair("page", &settings.page),
                            std::pair("dygraphs", &settings.dygraphs), std::pair("state", &settings.state)}) {
    if (section.has(key) && !file->empty()) *file = (base / *file).lexically_normal().string();
  }
  return section.finish();
}

Json web_config_schema() { return schema_of_file("prismweb", "tools/prismweb/web_config.cpp", keys().schema()); }

Result<void> load_web_config(const std::string& path, Settings& settings) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_web_config(*text, path, settings);
}

}  // namespace prism::prismweb
