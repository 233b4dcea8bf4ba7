// SPDX-License-Identifier: MIT
// One JSON object of a frame description: each key is asked for with its type and range; what is left over is refused.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/result.hpp"

namespace prism::wire {

using Json = nlohmann::ordered_json;

/// What stands there, short enough for a message: 3.5, "text", an object …
std::string found(const Json& json);

/// The first thing that was wrong. Readers go on with harmless values after it, so that they need no branches.
class Problems {
 public:
  explicit Problems(std::string file) : file_(std::move(file)) {}
  void add(const std::string& pointer, const std::string& what) {
    if (!first_) first_ = Error{file_ + ":" + (pointer.empty() ? "/" : pointer), what};
  }
  bool any() const { return first_.has_value(); }
  const std::optional<Error>& first() const { return first_; }

 private:
  std::string file_;
  std::optional<Error> first_;
};

/// The keys that an object of each section may have: the reader's law, and what the schema is compared with.
const std::vector<std::string>& section_keys(std::string_view section);
const std::vector<std::string>& section_names();

/// A view of one object. Every method names the pointer, what was found and what was expected where it refuses.
class Section {
 public:
  Section(Problems& problems, const Json& json, std::string pointer, std::string_view section);

  bool has(const char* key) const;
  std::string pointer(std::string_view key) const;
  const Json& at(const char* key) const { return *find(key); }
  Section sub(const char* key, std::string_view section) const;

  std::string text(const char* key, std::optional<std::string> preset = {}) const;
  double number(const char* key, double low, double high, std::optional<double> preset = {}) const;
  std::int64_t whole(const char* key, std::int64_t low, std::int64_t high,
                     std::optional<std::int64_t> preset = {}) const;
  bool flag(const char* key, bool preset) const;
  /// One of `choices`; the first is the preset where `required` is false.
  std::string choice(const char* key, std::initializer_list<const char*> choices, bool required = false) const;
  /// "big" (true) or "little".
  bool byte_order(const char* key, bool preset_big) const {
    return has(key) ? choice(key, {"big", "little"}, true) == "big" : preset_big;
  }
  /// An unsigned number: a JSON number or text like "0x1021".
  std::uint64_t bits(const char* key, std::optional<std::uint64_t> preset = {}) const;
  /// Text of hex digits, blanks between bytes allowed.
  std::vector<std::uint8_t> bytes(const char* key, bool required = true) const;
  std::vector<double> numbers(const char* key) const;
  std::vector<std::uint64_t> bit_list(const char* key) const;  ///< an array, or one alone
  std::vector<std::string> texts(const char* key) const;       ///< an array, or one alone

  void refuse(std::string_view key, const std::string& what) const { problems_->add(pointer(key), what); }
  Problems& problems() const { return *problems_; }

 private:
  const Json* find(const char* key) const;
  std::optional<std::uint64_t> unsigned_value(const Json& json) const;

  Problems* problems_;
  const Json* json_;
  std::string pointer_;
};

/// Calls read(Section) for each object of an array (or for one object that stands alone).
template <class Read>
void for_each_section(const Section& s, const char* key, std::string_view section, Read read) {
  if (!s.has(key)) return;
  const Json& json = s.at(key);
  if (json.is_object()) return read(Section(s.problems(), json, s.pointer(key), section));
  if (!json.is_array()) return s.refuse(key, found(json) + " is neither an object nor an array of objects");
  for (std::size_t i = 0; i < json.size(); ++i) {
    read(Section(s.problems(), json[i], s.pointer(std::string(key) + "/" + std::to_string(i)), section));
  }
}

}  // namespace prism::wire
