// SPDX-License-Identifier: MIT
#include "tools/prismweb/web_config.hpp"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>

#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "tools/prismweb/access.hpp"

namespace prism::prismweb {
namespace {

namespace fs = std::filesystem;

std::string path_of(const Section& section, const char* key, const fs::path& base, const std::string& otherwise) {
  const std::string path = section.text(key, otherwise);
  return path.empty() ? path : (base / path).lexically_normal().string();
}

void read_listen(const Section& section, Settings& settings) {
  const std::string listen = section.text("listen");
  if (const auto parsed = parse_listen(listen, settings); !parsed) section.fail("listen", parsed.error().what);
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
  section.any("$schema");  // for editors
  if (section.has("listen") && section.has("socket"))
    section.fail("socket", "conflicts with \"listen\"; use one of them");
  if (section.has("listen")) read_listen(section, settings);
  if (section.has("socket")) {
    settings.unix_socket = path_of(section, "socket", base, "");
    settings.address.clear();
    if (settings.unix_socket.empty()) section.fail("socket", "found \"\", expected a path");
  }
  if (section.has("hosts")) settings.hosts = section.texts("hosts");
  if (section.has("instances")) settings.instances = section.texts("instances");
  settings.page = path_of(section, "page", base, settings.page);
  settings.dygraphs = path_of(section, "dygraphs", base, settings.dygraphs);
  settings.state = path_of(section, "state", base, settings.state);
  return section.finish();
}

Result<void> load_web_config(const std::string& path, Settings& settings) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_web_config(*text, path, settings);
}

}  // namespace prism::prismweb
