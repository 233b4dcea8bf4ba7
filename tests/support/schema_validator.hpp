// SPDX-License-Identifier: MIT
// Validator of the part of JSON Schema (drafts 7 and 2020-12) that the project's schemas use.
#pragma once

#include <regex.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace prism::test {

class SchemaValidator {
 public:
  using Json = nlohmann::ordered_json;

  explicit SchemaValidator(Json schema) : root_(std::move(schema)) {}

  bool accepts(const Json& document) const { return valid(root_, document); }

 private:
  static bool is_type(const std::string& type, const Json& value) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "number") return value.is_number();
    if (type == "integer") return value.is_number_integer();
    throw std::runtime_error("the validator does not know the type " + type);
  }

  bool valid(const Json& schema, const Json& value) const {
    for (const auto& [key, rule] : schema.items()) {
      if (!keyword_holds(key, rule, schema, value)) return false;
    }
    return true;
  }

  bool keyword_holds(const std::string& key, const Json& rule, const Json& schema, const Json& value) const {
    if (key == "$ref") return valid(root_.at(Json::json_pointer(rule.get<std::string>().substr(1))), value);
    if (key == "type") return is_type(rule, value);
    if (key == "const") return value == rule;
    if (key == "enum") return std::find(rule.begin(), rule.end(), value) != rule.end();
    if (key == "minimum") return !value.is_number() || value.get<double>() >= rule.get<double>();
    if (key == "maximum") return !value.is_number() || value.get<double>() <= rule.get<double>();
    if (key == "minLength") return !value.is_string() || value.get<std::string>().size() >= rule.get<std::size_t>();
    if (key == "maxLength") return !value.is_string() || value.get<std::string>().size() <= rule.get<std::size_t>();
    if (key == "minItems") return !value.is_array() || value.size() >= rule.get<std::size_t>();
    if (key == "maxItems") return !value.is_array() || value.size() <= rule.get<std::size_t>();
    if (key == "propertyNames") return names_hold(rule, value);
    if (key == "minProperties") return !value.is_object() || value.size() >= rule.get<std::size_t>();
    if (key == "pattern") return !value.is_string() || matches(rule, value);
    if (key == "anyOf")
      return std::any_of(rule.begin(), rule.end(), [&](const Json& one) { return valid(one, value); });
    if (key == "allOf")
      return std::all_of(rule.begin(), rule.end(), [&](const Json& one) { return valid(one, value); });
    if (key == "items")
      return !value.is_array() ||
             std::all_of(value.begin(), value.end(), [&](const Json& one) { return valid(rule, one); });
    if (key == "required") return has_all(rule, value);
    if (key == "properties" || key == "additionalProperties") return members_hold(schema, value);
    if (key == "$schema" || key == "$comment" || key == "title" || key == "description" || key == "definitions" ||
        key == "$defs" || key == "default")
      return true;
    throw std::runtime_error("the validator does not know " + key);
  }

  struct Pattern {
    Pattern() = default;
    Pattern(const Pattern&) = delete;
    Pattern& operator=(const Pattern&) = delete;
    ~Pattern() { regfree(&compiled); }
    regex_t compiled{};
  };

  /// The patterns of the schema are POSIX expressions too. Compiled once and kept until the tests end.
  static bool matches(const std::string& pattern, const std::string& text) {
    static std::map<std::string, Pattern> patterns;
    const auto [at, is_new] = patterns.try_emplace(pattern);
    if (is_new && regcomp(&at->second.compiled, pattern.c_str(), REG_EXTENDED | REG_NOSUB) != 0)
      throw std::runtime_error("no pattern: " + pattern);
    return regexec(&at->second.compiled, text.c_str(), 0, nullptr, 0) == 0;
  }

  static bool has_all(const Json& required, const Json& value) {
    return !value.is_object() || std::all_of(required.begin(), required.end(),
                                             [&](const Json& key) { return value.contains(key.get<std::string>()); });
  }

  bool names_hold(const Json& rule, const Json& value) const {
    if (!value.is_object()) return true;
    for (const auto& [key, member] : value.items()) {
      if (!valid(rule, key)) return false;
    }
    return true;
  }

  bool members_hold(const Json& schema, const Json& value) const {
    if (!value.is_object()) return true;
    const Json properties = schema.value("properties", Json::object());
    for (const auto& [key, member] : value.items()) {
      if (properties.contains(key)) {
        if (!valid(properties.at(key), member)) return false;
      } else if (schema.contains("additionalProperties")) {
        const Json& others = schema.at("additionalProperties");
        if (others.is_boolean() ? !others.get<bool>() : !valid(others, member)) return false;
      }
    }
    return true;
  }

  Json root_;
};

}  // namespace prism::test
