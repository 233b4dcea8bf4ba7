// SPDX-License-Identifier: MIT
#include "base/json_table.hpp"

#include <fmt/format.h>

#include <map>

namespace prism {
namespace {

constexpr std::size_t kLongestLine = 160;  // of a value in a schema's file

void add_text(const Json& json, const std::string& indent, std::string& text) {
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

std::string number_text(const Json& number) {
  return number.is_number_integer() ? number.dump() : fmt::format("{:.10g}", number.get<double>());
}

std::string type_text(const Json& key) {
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
std::string escaped(const std::string& text) {
  std::string all;
  for (const char c : text) all += c == '\\' ? "\\\\" : std::string(1, c);
  return all;
}

// "*log/keep_days* (1 to 36500; *3650*)"
std::string heading(const std::string& path, const Json& key) {
  const Json usual = key.value("default", Json());
  const std::string value = usual.dump();
  std::string known = type_text(key);
  if (!usual.is_null()) {
    known += known.empty() ? "" : "; ";
    known += fmt::format("*{}*", escaped(usual.is_string() ? value.substr(1, value.size() - 2) : value));
  }
  return known.empty() ? fmt::format("*{}*", path) : fmt::format("*{}* ({})", path, known);
}

struct SharedObjects {
  std::map<std::string, int> counts;         // by text
  std::map<std::string, std::string> names;  // of those in `all`, by text
  Json all = Json::object();

  void count(const Json& schema) {
    if (!schema.is_structured()) return;
    if (schema.contains("properties")) ++counts[schema.dump()];
    for (const Json& below : schema) count(below);
  }

  // `key`: the nearest one that has the schema.
  Json moved(const Json& schema, const std::string& key) {
    if (!schema.is_structured()) return schema;
    const std::string text = schema.dump();
    if (const auto known = names.find(text); known != names.end()) return {{"$ref", "#/$defs/" + known->second}};
    Json changed = schema;
    for (const auto& [name, below] : changed.items()) {
      if (!schema.is_object() || name != "properties") {
        changed.at(Json::json_pointer("/" + name)) = moved(below, key);
        continue;
      }
      for (const auto& [member, value] : below.items()) changed["properties"][member] = moved(value, member);
    }
    if (counts[text] < 2) return changed;
    std::string name = key;
    while (all.contains(name)) name += "_";
    names[text] = name;
    all[name] = changed;
    return {{"$ref", "#/$defs/" + name}};
  }
};

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

}  // namespace

Json schema_of_file(const std::string& program, const std::string& source, const Json& object) {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"$comment", "SPDX-License-Identifier: MIT. For editors; written from " + source + " by its test."},
                 {"title", program + " configuration"}};
  schema.update(object);
  return schema;
}

Json plain_number(double number) {
  const bool is_integer = std::abs(number) < 1e15 && number == std::round(number);
  return is_integer ? Json(static_cast<std::int64_t>(number)) : Json(number);
}

Json limits_schema(const char* type, Range range) {
  Json json = {{"type", type}};
  if (range.min > kAnyNumber.min) json["minimum"] = plain_number(range.min);
  if (range.max < kAnyNumber.max) json["maximum"] = plain_number(range.max);
  return json;
}

Json unsigned_schema() {
  const Json text = {{"type", "string"}, {"pattern", "^(0[xX][0-9a-fA-F]+|[0-9]+)$"}};
  return {{"anyOf", {limits_schema("integer", {0, kAnyNumber.max}), text}}};
}

Json one_or_more_schema(const Json& one, int least) {
  Json several = {{"type", "array"}, {"items", one}};
  if (least > 0) several["minItems"] = least;
  return {{"anyOf", {one, several}}};
}

Json with_shared_objects(const Json& schema) {
  SharedObjects shared;
  shared.count(schema);
  Json changed = shared.moved(schema, "");
  changed["$defs"] = shared.all;
  return changed;
}

std::string schema_text(const Json& schema) {
  std::string text;
  add_text(schema, "", text);
  return text + "\n";
}

std::string man_keys(const Json& schema) {
  ManPage page;
  page.add("", schema.at("properties"));
  return page.text;
}

}  // namespace prism
