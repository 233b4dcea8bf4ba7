// SPDX-License-Identifier: MIT
// A strict parser for the elements of a page or drawing.
#pragma once

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace prism::test {

/// Returns the length of the tag name and quoted attributes at the start of `text`, up to ">" or "/>"; npos: malformed.
inline std::size_t tag_length(std::string_view text) {
  char quote = '\0';
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quote != '\0') {
      if (text[i] == quote) quote = '\0';
      if (text[i] == '<') return std::string_view::npos;
    } else if (text[i] == '"') {
      quote = '"';
    } else if (text[i] == '>') {
      return i;
    } else if (text[i] == '<' || text[i] == '\'') {
      return std::string_view::npos;
    }
  }
  return std::string_view::npos;
}

/// Returns "name attribute=" of each start tag in order, or nullopt if tags are malformed or not properly nested. Skips
/// the contents of scripts and styles.
inline std::optional<std::vector<std::string>> elements_of(std::string_view text) {
  static const std::set<std::string> kVoid = {"meta", "!DOCTYPE"};
  std::vector<std::string> found, open;
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string_view::npos;) {
    const std::string_view rest = text.substr(at + 1);
    const std::size_t length = tag_length(rest);
    if (length == std::string_view::npos) return std::nullopt;
    const std::string_view tag = rest.substr(0, length);
    const std::string name(tag.substr(0, tag.find_first_of(" /", 1)));
    at += length + 2;
    if (name.starts_with('/')) {
      if (open.empty() || open.back() != name.substr(1)) return std::nullopt;
      open.pop_back();
      continue;
    }
    found.push_back(name);
    bool quoted = false;
    for (const char c : tag.substr(name.size())) {
      if (c == '"') quoted = !quoted;
      if (!quoted && c != '"') found.back() += c;
    }
    if (kVoid.contains(name) || tag.ends_with('/')) continue;
    if (name == "script" || name == "style") {
      at = text.find("</" + name + ">", at);
      if (at == std::string_view::npos) return std::nullopt;
    }
    open.push_back(name);
  }
  if (!open.empty()) return std::nullopt;
  return found;
}

}  // namespace prism::test
