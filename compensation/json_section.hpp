// SPDX-License-Identifier: MIT
// Strict reading of one JSON object: every key used exactly once, every refusal with its place, all in one line.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/result.hpp"

namespace prism {

/// JSON text (comments allowed) → value. Refuses what is no JSON (file:line:column), a key given twice in one object,
/// and anything that is not an object at the top.
Result<nlohmann::json> parse_json_object(std::string_view text, std::string_view where);

struct Range {
  double min, max;
};

/// Reads the keys of one object straight down the page. The first thing wrong is remembered; from there on every getter
/// returns its default, and finish() tells. Sections made by object() report to the same first error as their parent.
class Section {
 public:
  Section(const nlohmann::json& object, std::string where);

  bool has(const char* key) const;

  // Without a default the key must be there. Numbers outside the range, non-finite numbers and wrong types are refused.
  double number(const char* key, Range range, std::optional<double> otherwise = {});
  std::int64_t integer(const char* key, Range range, std::optional<std::int64_t> otherwise = {});
  bool boolean(const char* key, std::optional<bool> otherwise = {});
  std::string text(const char* key, std::optional<std::string> otherwise = {});
  std::vector<double> numbers(const char* key, Range range, bool required = true);
  std::vector<std::string> texts(const char* key, bool required = true);
  /// One of the names given; returns its index.
  std::size_t choice(const char* key, std::span<const char* const> names, std::optional<std::size_t> otherwise = {});
  /// A nested object; an empty one where the key is absent and not required.
  Section object(const char* key, bool required = false);
  /// A nested array of objects.
  std::vector<Section> objects(const char* key, bool required = true);
  /// Any value, taken as it is; null where it is absent.
  nlohmann::json any(const char* key);

  /// Remembers an error at `key` of this section (or at the section itself where key is empty).
  void fail(const std::string& key, std::string what);
  bool good() const { return !state_->error; }
  /// Refuses keys that nobody asked for, here and in every section made from this one; then the first error, if any.
  Result<void> finish();

 private:
  struct State {
    std::optional<Error> error;
    std::vector<std::pair<const nlohmann::json*, std::string>> sections;
    std::set<std::pair<const nlohmann::json*, std::string>> used;
  };
  Section(const nlohmann::json& object, std::string where, std::shared_ptr<State> state);
  const nlohmann::json* take(const char* key, bool required);
  template <class T, class Read>
  T read(const char* key, const std::optional<T>& otherwise, Read&& convert);

  const nlohmann::json* object_;
  std::string where_;
  std::shared_ptr<State> state_;
};

/// How a value is shown in a refusal: its text, cut at 40 characters.
std::string shown(const nlohmann::json& value);

}  // namespace prism
