// SPDX-License-Identifier: MIT
// Strict reader of JSON: reports unknown and missing keys, wrong types and ranges with their position in one line.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/outside_text.hpp"
#include "base/result.hpp"

namespace prism {

struct JsonDocument;
template <class T>
class JsonTable;

struct Range {
  double min, max;
  bool operator==(const Range&) const = default;
};
inline constexpr Range kAnyNumber{std::numeric_limits<double>::lowest(), std::numeric_limits<double>::max()};

enum class KeyFile : std::uint8_t { kPrismd, kFrames, kWeb, kRelay, kCampaign };

/// A key of the files of earlier versions that this version does not read.
struct RemovedKey {
  KeyFile file;
  std::string_view path;  ///< steps joined by '/'; "*" is any key or element, "**" none or several of them
  /// True if a file must not be used without this key: the key could change a number or close a door. Else the program
  /// warns and starts, because an upgrade must not end a recording.
  bool stops;
  std::string_view instead;  ///< the replacement, as the end of a sentence
};

/// The one table for all programs (base/removed_keys.cpp).
std::span<const RemovedKey> removed_keys();

/// A view of one object whose keys are read in turn. Keeps the first error; after it every getter returns a harmless
/// value, and finish() returns the error. All sections of a document share this error. The document must outlive its
/// sections.
class Section {
 public:
  explicit Section(const JsonDocument& document);

  /// These three mark a key as known without reading it.
  bool has(const std::string& key) const { return look(key) != nullptr; }
  bool is_object(const std::string& key) const;
  bool is_array(const std::string& key) const;
  /// Stores an error if the key is missing.
  void require(const std::string& key) const { take(key, true); }
  /// Marks the removed keys of this file as known; call it before other keys of the document are read. Returns a
  /// warning for each key that has no effect any more, and stores an error at the first that stops the program.
  std::vector<std::string> removed(KeyFile file, std::span<const RemovedKey> table = removed_keys()) const;
  /// For an object whose keys are names: all keys that follow the rule, in the order of the text. Other keys are
  /// errors.
  std::vector<std::string> names(TextRule rule) const;

  // Without a default the key is required. Errors: a number outside the range, a non-finite number, a wrong type.
  double number(const std::string& key, Range range, std::optional<double> otherwise = {}) const;
  std::int64_t integer(const std::string& key, Range range, std::optional<std::int64_t> otherwise = {}) const;
  bool boolean(const std::string& key, std::optional<bool> otherwise = {}) const;
  /// A string that follows the rule (kLongText: printable).
  std::string text(const std::string& key, std::optional<std::string> otherwise = {},
                   TextRule rule = TextRule::kLongText) const;
  /// A string of any characters: bytes for a line, separators.
  std::string raw_text(const std::string& key, std::optional<std::string> otherwise = {}) const;
  std::vector<double> numbers(const std::string& key, Range range, bool required = true) const;
  /// One printable string, or an array of at least one.
  std::vector<std::string> texts(const std::string& key, bool required = true) const;
  /// One of the given names; returns its index.
  std::size_t choice(const std::string& key, std::span<const char* const> choices,
                     std::optional<std::size_t> otherwise = {}) const;
  std::size_t choice(const std::string& key, std::initializer_list<const char*> choices,
                     std::optional<std::size_t> otherwise = {}) const {
    return choice(key, std::span(choices.begin(), choices.size()), otherwise);
  }
  /// The same; an error lists each name with its meaning.
  struct Choice {
    const char *name, *meaning;
  };
  std::size_t explained_choice(const std::string& key, std::initializer_list<Choice> choices) const;
  /// An unsigned number of up to 64 bits: a number, or a string like "0x1F".
  std::uint64_t bits(const std::string& key, std::optional<std::uint64_t> otherwise = {}) const;
  /// One unsigned number, or an array of at least one.
  std::vector<std::uint64_t> bit_list(const std::string& key) const;
  /// At least one byte in hex: "A5 5A". Empty if the key is absent and not required.
  std::vector<std::uint8_t> bytes(const std::string& key, bool required = true) const;
  /// The document.
  Section top() const;
  /// A nested object; empty if the key is absent and not required.
  Section object(const std::string& key, bool required = false) const;
  /// A nested array of objects.
  std::vector<Section> objects(const std::string& key, bool required = true) const;
  /// Any value; null if it is absent. Every key and string in it must be printable.
  nlohmann::ordered_json any(const std::string& key) const;

  /// Stores an error at `key` (steps joined by '/') of this section, or at the section itself if `key` is empty.
  void fail(const std::string& key, std::string what) const;
  bool good() const { return !state_->error; }
  /// Position of this section for messages: file, or file:/pointer.
  std::string where() const;
  /// Returns the first error. Without one: an error if this section or any other of the document has an unknown key.
  Result<void> finish() const;

 private:
  using Json = nlohmann::ordered_json;
  struct State {
    const JsonDocument* document;
    std::optional<Error> error;
    std::vector<std::pair<const Json*, std::string>> sections;  ///< opened so far, with their pointers
    std::map<const Json*, std::set<std::string>> asked;         ///< known keys of each object
  };
  Section(const Json& object, std::string pointer, std::shared_ptr<State> state);
  const Json* look(const std::string& key) const;
  const Json* take(const std::string& key, bool required) const;
  void mark_removed(const Json& value, const std::string& pointer, std::string_view path, const RemovedKey& key,
                    std::vector<std::string>& warnings) const;
  void reject_unknown(const Json& object, const std::string& pointer) const;
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
