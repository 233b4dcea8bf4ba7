// SPDX-License-Identifier: MIT
// Strict reading of JSON: every key used exactly once, every refusal with its place, all in one line.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/json_document.hpp"
#include "base/outside_text.hpp"
#include "base/result.hpp"

namespace prism {

struct Range {
  double min, max;
};
inline constexpr Range kAnyNumber{std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max()};

/// A view of one object, read key by key straight down the page. The first thing wrong is remembered; from there on
/// every getter goes on with a harmless value, and finish() tells. All sections of a document share that first error.
/// The document must outlive its sections.
class Section {
 public:
  explicit Section(const JsonDocument& document);

  /// These three ask for a key without reading it; a key that was asked for is not unknown.
  bool has(const std::string& key) const { return look(key) != nullptr; }
  bool is_object(const std::string& key) const;
  bool is_array(const std::string& key) const;
  /// Keys that are legal here although this object's other keys give them no meaning.
  void allow(std::initializer_list<const char*> keys) const;
  /// For an object whose keys are names: all that follow the rule, in the order of the text. A key that does not is an
  /// error.
  std::vector<std::string> names(TextRule rule) const;

  // Without a default the key must be there. Numbers outside the range, non-finite numbers and wrong types are refused.
  double number(const std::string& key, Range range, std::optional<double> otherwise = {}) const;
  std::int64_t integer(const std::string& key, Range range, std::optional<std::int64_t> otherwise = {}) const;
  bool boolean(const std::string& key, std::optional<bool> otherwise = {}) const;
  /// A text that follows the rule (kLongText: printable).
  std::string text(const std::string& key, std::optional<std::string> otherwise = {},
                   TextRule rule = TextRule::kLongText) const;
  /// A text of any characters: bytes for a line, separators.
  std::string raw_text(const std::string& key, std::optional<std::string> otherwise = {}) const;
  std::vector<double> numbers(const std::string& key, Range range, bool required = true) const;
  /// One printable text, or an array of at least one.
  std::vector<std::string> texts(const std::string& key, bool required = true) const;
  /// One of the names given; returns its index.
  std::size_t choice(const std::string& key, std::span<const char* const> choices,
                     std::optional<std::size_t> otherwise = {}) const;
  std::size_t choice(const std::string& key, std::initializer_list<const char*> choices,
                     std::optional<std::size_t> otherwise = {}) const {
    return choice(key, std::span(choices.begin(), choices.size()), otherwise);
  }
  /// An unsigned number of up to 64 bits: a number, or text like "0x1F".
  std::uint64_t bits(const std::string& key, std::optional<std::uint64_t> otherwise = {}) const;
  /// One unsigned number, or an array of at least one.
  std::vector<std::uint64_t> bit_list(const std::string& key) const;
  /// At least one byte in hex: "A5 5A". Nothing where the key is absent and not required.
  std::vector<std::uint8_t> bytes(const std::string& key, bool required = true) const;
  /// A nested object; an empty one where the key is absent and not required.
  Section object(const std::string& key, bool required = false) const;
  /// A nested array of objects.
  std::vector<Section> objects(const std::string& key, bool required = true) const;
  /// One nested object, an array of them, or nothing.
  std::vector<Section> one_or_more_objects(const std::string& key) const;
  /// Any value; null if it is absent. Every key and text in it must be printable.
  Json any(const std::string& key) const;

  /// Remembers an error at `key` (steps joined by '/') of this section, or at the section itself where key is empty.
  void fail(const std::string& key, std::string what) const;
  bool good() const { return !state_->error; }
  /// This section's place for messages: file, or file:/pointer.
  std::string where() const;
  /// Refuses keys that nobody asked for, here and in every section of the document; then the first error, if any.
  Result<void> finish() const;

 private:
  struct State {
    const JsonDocument* document;
    std::optional<Error> error;
    std::vector<std::pair<const Json*, std::string>> sections;  ///< opened so far, with their pointers
    std::map<const Json*, std::set<std::string>> asked;         ///< keys of each object
  };
  Section(const Json& object, std::string pointer, std::shared_ptr<State> state);
  const Json* look(const std::string& key) const;
  const Json* take(const std::string& key, bool required) const;
  void refuse_unknown(const Json& object, const std::string& pointer) const;
  Section below(const Json& object, const std::string& key) const;
  template <class T, class Read>
  T read(const std::string& key, const std::optional<T>& otherwise, T harmless, Read&& convert) const;
  template <class T, class Read>
  std::vector<T> one_or_more(const std::string& key, bool required, const char* what, Read&& convert) const;

  const Json* object_;
  std::string pointer_;
  std::shared_ptr<State> state_;
};

}  // namespace prism
