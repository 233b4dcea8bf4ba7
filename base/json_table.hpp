// SPDX-License-Identifier: MIT
// Tables of the keys of JSON objects: each row reads a key, prints it, and describes it in the schema and the man page.
#pragma once

#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/json_document.hpp"
#include "base/json_section.hpp"

namespace prism {

/// The schema of a file from that of its object. `source` has the table; its test writes the file.
Json schema_of_file(const std::string& program, const std::string& source, const Json& object);

/// A number, as an integer if it is one.
Json plain_number(double number);
/// A "number" or an "integer" within a range.
Json limits_schema(const char* type, Range range);
/// An unsigned number of up to 64 bits: a number, or a string like "0x1F".
Json unsigned_schema();
/// One, or an array of at least `least`.
Json one_or_more_schema(const Json& one, int least);

/// kRequiredByCheck: the row's own function, or a check, has the error.
enum Required { kRequired, kRequiredByCheck };

/// The help of a key: "text", kRequired, or {kRequired, "text"}.
struct KeyHelp {
  KeyHelp(const char* help) : text(help) {}
  KeyHelp(Required by, const char* help = "") : text(help), is_required(true), has_own_error(by == kRequiredByCheck) {}

  const char* text;
  bool is_required = false, has_own_error = false;
};

/// The keys of a JSON object that a T stores. A row names a member of T by a pointer to it, or by a function that
/// returns a reference to it. An absent key leaves the member unchanged; an optional member without a value is printed
/// as null. `help` is plain text; a key without help shares that of the next key in the man page. The functions of a
/// row share the table of a nested object: copies at each level took half of the start of prismd.
template <class T>
class JsonTable {
 public:
  struct Row {
    std::string key;  ///< empty: a check of several keys
    Json schema;      ///< type, limits and help, without the default
    std::function<void(const Section&, T&)> read;
    std::function<void(const T&, Json&)> print;    ///< puts the key into the object, or nothing
    std::function<Json(const T& usual)> usual;     ///< a plain value; null: without a default
    std::function<Json(const T& usual)> contents;  ///< of an object: its part of the schema; null: a plain value
    bool is_required = false, has_own_error = false;
  };

  /// Errors are those of the section; `object` has the defaults.
  void read(const Section& section, T& object) const {
    for (const Row& row : rows_) {
      if (row.is_required && !row.has_own_error && section.good()) section.require(row.key);
      if (section.good()) row.read(section, object);
    }
  }

  Json print(const T& object) const {
    Json json = Json::object();
    for (const Row& row : rows_) {
      if (row.print) row.print(object, json);
    }
    return json;
  }

  /// JSON Schema of the object; `usual` has the defaults.
  Json schema(const T& usual = T()) const {
    Json keys = Json::object(), required = Json::array();
    for (const Row& row : rows_) {
      if (row.key.empty()) continue;
      Json& key = keys[row.key] = row.schema;
      if (row.contents) key.update(row.contents(usual));
      if (row.is_required) required.push_back(row.key);
      const Json value = row.usual && !row.is_required ? row.usual(usual) : Json();
      const bool cannot_be_stated = value.is_number() && value < key.value("minimum", value);
      const bool says_nothing =
          value.is_null() || value == "" || (value.is_array() && value.empty()) || cannot_be_stated;
      if (!says_nothing) key["default"] = value.is_number() ? plain_number(value.get<double>()) : value;
    }
    Json json = {{"type", "object"}, {"additionalProperties", false}};
    if (!required.empty()) json["required"] = required;
    json["properties"] = std::move(keys);
    return json;
  }

  const std::vector<Row>& rows() const { return rows_; }

  /// A number stored in another unit: member = number · unit.
  template <class Member>
  JsonTable& number(const char* key, Range range, Member member, KeyHelp help, double unit = 1) {
    return value(
        key, limits_schema("number", range), member, help,
        [range, unit](const Section& section, const std::string& name) { return section.number(name, range) * unit; },
        [unit](auto stored) { return shown_number(static_cast<double>(stored) / unit); });
  }

  template <class Member>
  JsonTable& integer(const char* key, Range range, Member member, KeyHelp help, std::int64_t unit = 1) {
    return value(
        key, limits_schema("integer", range), member, help,
        [range, unit](const Section& section, const std::string& name) { return section.integer(name, range) * unit; },
        [unit](auto stored) { return Json(count(stored) / unit); });
  }

  template <class Member>
  JsonTable& boolean(const char* key, Member member, KeyHelp help) {
    return value(
        key, {{"type", "boolean"}}, member, help,
        [](const Section& section, const std::string& name) { return section.boolean(name); },
        [](bool stored) { return Json(stored); });
  }

  template <class Member>
  JsonTable& text(const char* key, Member member, KeyHelp help, TextRule rule = TextRule::kLongText) {
    return value(
        key, {{"type", "string"}}, member, help,
        [rule](const Section& section, const std::string& name) { return section.text(name, {}, rule); },
        [](const std::string& stored) { return Json(stored); });
  }

  /// A string of any characters.
  template <class Member>
  JsonTable& raw_text(const char* key, Member member, KeyHelp help) {
    return value(
        key, {{"type", "string"}}, member, help,
        [](const Section& section, const std::string& name) { return section.raw_text(name); },
        [](const auto& stored) { return Json(stored); });
  }

  /// An unsigned number of up to 64 bits: a number, or a string like "0x1F".
  template <class Member>
  JsonTable& bits(const char* key, Member member, KeyHelp help) {
    return value(
        key, unsigned_schema(), member, help,
        [](const Section& section, const std::string& name) { return section.bits(name); },
        [](std::uint64_t) { return Json(); });
  }

  /// One of them, or an array of at least one.
  template <class Member>
  JsonTable& bit_list(const char* key, Member member, KeyHelp help) {
    return value(
        key, one_or_more_schema(unsigned_schema(), 1), member, help,
        [](const Section& section, const std::string& name) { return section.bit_list(name); },
        [](const auto&) { return Json(); });
  }

  /// Bytes in hex: "A5 5A".
  template <class Member>
  JsonTable& bytes(const char* key, Member member, KeyHelp help) {
    return value(
        key, {{"type", "string"}, {"pattern", "^( *[0-9a-fA-F]{2})+ *$"}}, member, help,
        [](const Section& section, const std::string& name) { return section.bytes(name); },
        [](const std::vector<std::uint8_t>&) { return Json(); });
  }

  /// An array of numbers; the member is a vector of the standard library or of Eigen, or a matrix: it has one column.
  template <class Member>
  JsonTable& numbers(const char* key, Range range, Member member, KeyHelp help) {
    return value(
        key, {{"type", "array"}, {"items", limits_schema("number", range)}}, member, help,
        [range](const Section& section, const std::string& name) { return section.numbers(name, range); },
        [](const auto& stored) {
          const std::vector<double> numbers(stored.data(), stored.data() + stored.size());
          return numbers.empty() ? Json() : Json(numbers);
        });
  }

  /// One string, or an array of at least one.
  template <class Member>
  JsonTable& texts(const char* key, Member member, KeyHelp help) {
    return value(
        key, one_or_more_schema({{"type", "string"}}, 1), member, help,
        [](const Section& section, const std::string& name) { return section.texts(name); },
        [](const std::vector<std::string>& stored) { return Json(stored); });
  }

  /// The member is a string with one of the names, or their index.
  template <class Member>
  JsonTable& choice(const char* key, std::span<const char* const> names, Member member, KeyHelp help) {
    std::vector<const char*> all(names.begin(), names.end());
    return value(
        key, {{"type", "string"}, {"enum", all}}, member, help,
        [all](const Section& section, const std::string& name) {
          const std::size_t index = section.choice(name, all);
          return Choice{index, all[index]};
        },
        [all](const auto& stored) {
          if constexpr (std::is_convertible_v<decltype(stored), std::string>) {
            return Json(stored);
          } else {
            return Json(all[static_cast<std::size_t>(stored)]);
          }
        });
  }

  /// A nested object. An optional member gets a value if the key exists.
  template <class X, class Member>
  JsonTable& object(const char* key, const JsonTable<X>& table, Member member, KeyHelp help) {
    Row& row = add(key, Json::object(), help);
    const auto inner = std::make_shared<const JsonTable<X>>(table);
    row.read = [=](const Section& section, T& object) {
      auto& stored = std::invoke(member, object);
      if (!section.has(key)) return;
      if constexpr (requires { stored.has_value(); }) {
        inner->read(section.object(key), stored ? *stored : stored.emplace());
      } else {
        inner->read(section.object(key), stored);
      }
    };
    row.print = [=](const T& object, Json& json) {
      json[key] = printed(std::invoke(member, object), [&](const X& stored) { return inner->print(stored); });
    };
    row.contents = [=](const T& usual) {
      const auto& stored = std::invoke(member, usual);
      if constexpr (requires { stored.has_value(); }) {
        return inner->schema(stored.value_or(X()));
      } else {
        return inner->schema(stored);
      }
    };
    return *this;
  }

  /// An object of named objects, stored in a vector; not printed if it is empty. `naming` is the member of X for the
  /// name; `label` stands for a name in the man page.
  template <class X, class Member, class Naming>
  JsonTable& named(const char* key, const char* label, TextRule rule, const JsonTable<X>& table, Member member,
                   Naming naming, KeyHelp help) {
    Row& row = add(key, {{"type", "object"}, {"$comment", label}}, help);
    const auto inner = std::make_shared<const JsonTable<X>>(table);
    row.read = [=](const Section& section, T& object) {
      const Section all = section.object(key);
      for (const std::string& name : all.names(rule)) {
        X& one = std::invoke(member, object).emplace_back();
        std::invoke(naming, one) = name;
        inner->read(all.object(name), one);
      }
    };
    row.print = [=](const T& object, Json& json) {
      for (const X& one : std::invoke(member, object)) json[key][std::invoke(naming, one)] = inner->print(one);
    };
    row.contents = [=](const T&) { return Json{{"additionalProperties", inner->schema()}}; };
    return *this;
  }

  /// An array of objects, stored in a vector or an optional one.
  template <class X, class Member>
  JsonTable& list(const char* key, const JsonTable<X>& table, Member member, KeyHelp help) {
    Row& row = add(key, {{"type", "array"}}, help);
    const auto inner = std::make_shared<const JsonTable<X>>(table);
    row.read = [=](const Section& section, T& object) {
      if (!section.has(key)) return;
      std::vector<X> all;
      for (const Section& one : section.objects(key)) inner->read(one, all.emplace_back());
      std::invoke(member, object) = std::move(all);
    };
    row.print = [=](const T& object, Json& json) {
      json[key] = printed(std::invoke(member, object), [&](const std::vector<X>& all) {
        Json array = Json::array();
        for (const X& one : all) array.push_back(inner->print(one));
        return array;
      });
    };
    row.contents = [=](const T&) { return Json{{"items", inner->schema()}}; };
    return *this;
  }

  /// Objects that `put(section, name, read object, object)` stores, each as it is read. They are not printed. `name` is
  /// empty but for kNamed.
  enum class Form { kOne, kOneOrMore, kList, kNamed };
  template <class X, class Put>
  JsonTable& objects(Form form, const char* key, const JsonTable<X>& table, Put put, KeyHelp help,
                     TextRule rule = TextRule::kMessageName) {
    Row& row = add(key, Json::object(), help);
    const auto inner = std::make_shared<const JsonTable<X>>(table);
    row.read = [=](const Section& section, T& object) {
      const auto read = [&](const Section& one, const std::string& name) {
        X stored{};
        inner->read(one, stored);
        if (one.good()) put(one, name, stored, object);
      };
      if (!section.has(key)) return;
      if (form == Form::kOne || (form == Form::kOneOrMore && !section.is_array(key)))
        return read(section.object(key), "");
      if (form == Form::kNamed) {
        const Section all = section.object(key);
        for (const std::string& name : all.names(rule)) read(all.object(name), name);
        return;
      }
      for (const Section& one : section.objects(key)) read(one, "");
    };
    row.contents = [=](const T&) {
      const Json one = inner->schema();
      if (form == Form::kOneOrMore) return one_or_more_schema(one, 0);
      if (form == Form::kList) return Json{{"type", "array"}, {"items", one}};
      return form == Form::kNamed ? Json{{"type", "object"}, {"additionalProperties", one}} : one;
    };
    return *this;
  }

  /// All rows of the table of a member: its keys are keys of this object.
  template <class X, class Member>
  JsonTable& group(const JsonTable<X>& table, Member member) {
    for (const auto& of_member : table.rows()) {
      const auto inner = std::make_shared<const typename JsonTable<X>::Row>(of_member);
      Row& row = rows_.emplace_back();
      row.key = inner->key, row.schema = inner->schema;
      row.is_required = inner->is_required, row.has_own_error = inner->has_own_error;
      row.read = [=](const Section& section, T& object) { inner->read(section, std::invoke(member, object)); };
      if (inner->print)
        row.print = [=](const T& object, Json& json) { inner->print(std::invoke(member, object), json); };
      if (inner->usual) row.usual = [=](const T& usual) { return inner->usual(std::invoke(member, usual)); };
      if (inner->contents) row.contents = [=](const T& usual) { return inner->contents(std::invoke(member, usual)); };
    }
    return *this;
  }

  JsonTable& group(const JsonTable& table) {
    rows_.insert(rows_.end(), table.rows_.begin(), table.rows_.end());
    return *this;
  }

  /// A plain value: `read` returns it from a section and a key, `print` returns its JSON.
  template <class Member, class Read, class Print>
  JsonTable& value(const char* key, Json schema, Member member, KeyHelp help, Read read, Print print) {
    Row& row = add(key, std::move(schema), help);
    row.read = [=](const Section& section, T& object) {
      if (section.has(key)) store(read(section, key), std::invoke(member, object));
    };
    row.usual = [=](const T& object) { return printed(std::invoke(member, object), print); };
    row.print = [key = row.key, shown = row.usual](const T& object, Json& json) { json[key] = shown(object); };
    return *this;
  }

  /// A key with its own functions: `read` reads it (also if it is absent), `print` puts it into the object.
  JsonTable& custom(const char* key, Json schema, KeyHelp help, std::function<void(const Section&, T&)> read,
                    std::function<void(const T&, Json&)> print) {
    Row& row = add(key, std::move(schema), help);
    row.read = std::move(read);
    row.print = std::move(print);
    return *this;
  }

  /// A key that the function of another row reads.
  JsonTable& known(const char* key, Json schema, KeyHelp help) {
    return custom(
        key, std::move(schema), help, [name = std::string(key)](const Section& section, T&) { section.has(name); },
        nullptr);
  }

  JsonTable& row(Row row) {
    rows_.push_back(std::move(row));
    return *this;
  }

  /// A check of several keys, or a default that depends on another key.
  JsonTable& then(std::function<void(const Section&, T&)> check) {
    add("", {}, "").read = std::move(check);
    return *this;
  }

  /// The schema of the last key has these rules, too: the check in then() has its own message.
  JsonTable& also(const Json& rules, bool is_required = false) {
    Row& row = rows_.back();
    if (!rules.is_null()) row.schema.update(rules);
    if (is_required && !row.is_required) row.is_required = row.has_own_error = true;
    return *this;
  }

  /// The last key is read by another function, also if it is absent.
  JsonTable& read_by(std::function<void(const Section&, T&)> read) {
    rows_.back().read = std::move(read);
    return *this;
  }

  /// The last key is printed by another function, which puts it into the object.
  JsonTable& print_by(std::function<void(const T&, Json&)> print) {
    rows_.back().print = std::move(print);
    return *this;
  }

  /// The last key is printed only if the condition is true.
  JsonTable& print_if(std::function<bool(const T&)> condition) {
    rows_.back().print = [condition, print = rows_.back().print](const T& object, Json& json) {
      if (condition(object)) print(object, json);
    };
    return *this;
  }

 private:
  struct Choice {
    std::size_t index;
    const char* name;
  };

  Row& add(const char* key, Json schema, KeyHelp help) {
    Row& row = rows_.emplace_back();
    row.key = key;
    row.schema = std::move(schema);
    if (*help.text != '\0') row.schema["description"] = help.text;
    row.is_required = help.is_required, row.has_own_error = help.has_own_error;
    return row;
  }

  static Json shown_number(double number) { return std::abs(number) < kAnyNumber.max ? Json(number) : Json(); }

  template <class Stored>
  static std::int64_t count(const Stored& stored) {
    if constexpr (requires { stored.count(); }) {
      return stored.count();
    } else {
      return static_cast<std::int64_t>(stored);
    }
  }

  template <class Value, class Member>
  static void store(const Value& value, Member& member) {
    if constexpr (requires { member.has_value(); }) {
      store(value, member.emplace());
    } else if constexpr (!std::is_same_v<Value, Member> && requires { Member::Map(value.data(), 1, 1); }) {
      member = Member::Map(value.data(), static_cast<std::ptrdiff_t>(value.size()), 1);
    } else if constexpr (!std::is_same_v<Value, Choice>) {
      member = static_cast<Member>(value);
    } else if constexpr (std::is_same_v<Member, std::string>) {
      member = value.name;
    } else {
      member = static_cast<Member>(value.index);
    }
  }

  template <class Member, class Print>
  static Json printed(const Member& member, const Print& print) {
    if constexpr (requires { member.has_value(); }) {
      return member ? Json(print(*member)) : Json();
    } else {
      return print(member);
    }
  }

  std::vector<Row> rows_;
};

}  // namespace prism
