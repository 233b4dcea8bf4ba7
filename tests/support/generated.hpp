// SPDX-License-Identifier: MIT
// Files that are written from a table of keys: with PRISM_REGENERATE=1 a test writes them, else it compares.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/json_table.hpp"
#include "tests/support/shared_files.hpp"

namespace prism::test {

inline constexpr std::size_t kLongestLine = 160;  // of a value in a schema's file

inline void add_text(const Json& json, const std::string& indent, std::string& text) {
  const std::string line = json.dump();
  const bool is_array = json.is_array();
  const bool fits = line.size() <= kLongestLine && (is_array || !json.contains("properties"));
  if (!json.is_structured() || json.empty() || (fits && (is_array || indent.size() > 2))) {
    text += line;
    return;
  }
  const char* between = is_array ? "[\n" : "{\n";
  for (const auto& [key, value] : json.items()) {
    text += fmt::format("{}{}  {}", between, indent, is_array ? "" : Json(key).dump() + ": ");
    add_text(value, indent + "  ", text);
    between = ",\n";
  }
  text += "\n" + indent + (is_array ? "]" : "}");
}

/// A schema as the text of its file: one line per key.
inline std::string schema_text(const Json& schema) {
  std::string text;
  add_text(schema, "", text);
  return text + "\n";
}

inline std::string number_text(const Json& number) {
  return number.is_number_integer() ? number.dump() : fmt::format("{:.10g}", number.get<double>());
}

inline std::string type_text(const Json& key) {
  if (key.contains("enum")) {
    std::string all;
    for (std::size_t i = 0; i < key["enum"].size(); ++i) {
      const Json& name = key["enum"][i];
      all += i == 0 ? "" : i + 1 < key["enum"].size() ? ", " : " or ";
      all += fmt::format("*{}*", name.is_string() ? name.get<std::string>() : name.dump());
    }
    return all;
  }
  if (key.contains("minimum")) return number_text(key["minimum"]) + " to " + number_text(key["maximum"]);
  const std::string type = key.value("type", "");
  if (type == "array") return key["items"].contains("properties") ? "a list" : "[low, high]";
  return type == "boolean" ? "*true* or *false*" : type == "number" ? "a number" : "";
}

// scdoc takes a backslash for an escape.
inline std::string escaped(const std::string& text) {
  std::string all;
  for (const char c : text) all += c == '\\' ? "\\\\" : std::string(1, c);
  return all;
}

// "*log/keep_days* (1 to 36500; *3650*)"
inline std::string heading(const std::string& path, const Json& key) {
  const Json usual = key.value("default", Json());
  const std::string value = usual.dump();
  std::string known = type_text(key);
  if (!usual.is_null()) {
    known += known.empty() ? "" : "; ";
    known += fmt::format("*{}*", escaped(usual.is_string() ? value.substr(1, value.size() - 2) : value));
  }
  return known.empty() ? fmt::format("*{}*", path) : fmt::format("*{}* ({})", path, known);
}

struct ManPage {
  std::map<std::string, std::string> described;  // name and schema of a key → its object's path
  std::string text = {};

  void add(const std::string& path, const Json& keys) {
    std::string shared;                                     // headings of the keys that share the next text
    std::map<std::string, std::vector<std::string>> again;  // by the place that describes them
    for (const auto& [name, key] : keys.items()) {
      if (name == "$schema") continue;
      const auto [known, is_new] = described.emplace(name + key.dump(), path);
      if (!is_new) {
        again[known->second].push_back("*" + name + "*");
        continue;
      }
      const Json* below = &key;
      std::string place = path + name + "/";
      if (const auto items = key.find("items"); items != key.end()) below = &*items;
      if (const auto named = key.find("additionalProperties"); named != key.end() && named->is_object()) {
        below = &*named;
        place += key["$comment"].get<std::string>() + "/";
      }
      const std::string help = key.value("description", "");
      const bool has_keys = below->is_object() && below->contains("properties");
      if (!has_keys || !help.empty()) shared += (shared.empty() ? "" : ", ") + heading(path + name, key);
      if (!help.empty()) text += std::exchange(shared, "") + "\n\t" + escaped(help) + "\n\n";
      if (has_keys) add(place, (*below)["properties"]);
    }
    std::string same;
    for (const auto& [place, names] : again) {
      same += fmt::format("{}{}: as {}", same.empty() ? "" : "; ", fmt::join(names, ", "),
                          place.empty() ? "those above" : "*" + place + "...*");
    }
    if (!same.empty()) text += fmt::format("*{}...*\n\t{}.\n\n", path, same);
  }
};

/// The keys of a schema as the section KEYS of a man page (scdoc).
inline std::string man_keys(const Json& schema) {
  ManPage page;
  page.add("", schema.at("properties"));
  return page.text;
}

/// `name`: of a file in the sources.
inline void expect_generated(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(PRISM_SOURCE_DIR) / name;
  if (std::getenv("PRISM_REGENERATE") != nullptr) std::ofstream(file) << text;
  EXPECT_TRUE(read_file(file) == text) << name << " differs: PRISM_REGENERATE=1 writes it";
}

/// The schema, and the keys in a man page from the end of the text `after` to the text `before`.
inline void expect_pages_of(const Json& schema, const std::string& schema_name, const std::string& page_name,
                            const std::string& after, const std::string& before) {
  expect_generated(schema_name, schema_text(schema));
  const std::string page = read_file(std::filesystem::path(PRISM_SOURCE_DIR) / page_name);
  const std::size_t begin = page.find(after) + after.size();
  expect_generated(page_name, page.substr(0, begin) + man_keys(schema) + page.substr(page.find(before, begin)));
}

}  // namespace prism::test
