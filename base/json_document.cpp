// SPDX-License-Identifier: MIT
#include "base/json_document.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <cstdio>
#include <iterator>
#include <optional>
#include <set>

#include "base/plain_text.hpp"

namespace prism {
namespace {

constexpr int kMaxDepth = 32;                   // limits recursion when a value is printed or freed
constexpr std::size_t kMaxKeys = 10'000;        // of one object: nlohmann's ordered objects search linearly
constexpr std::size_t kMaxValues = 20'000'000;  // of a document

/// Stops the parser: an exception is the only way to do so from a callback.
struct TooLarge {
  std::string what;
};

/// Reads a text by characters and counts lines, since the parser does not report the line of a key.
struct CountingIterator {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  const char* at;
  std::uint32_t* line;

  reference operator*() const { return *at; }
  CountingIterator& operator++() {
    if (*at++ == '\n') ++*line;
    return *this;
  }
  bool operator==(const CountingIterator& other) const { return at == other.at; }
};

// nlohmann writes "[…] parse error at line 3, column 5: syntax error while parsing value - unexpected …"; keep position
// and reason.
Error json_error(std::string_view where, const Json::exception& error) {
  const std::string_view message = error.what();
  const std::size_t place = message.find("at line "), reason = message.find(": ", place), code = message.find("] ");
  int line = 0, column = 0;
  if (place != message.npos && reason != message.npos &&
      std::sscanf(message.data() + place, "at line %d, column %d", &line, &column) == 2) {
    return {fmt::format("{}:{}:{}", where, line, column),
            "not valid JSON: " + plain_text(message.substr(reason + 2), 160)};
  }
  return {std::string(where),
          "not valid JSON: " + plain_text(message.substr(code == message.npos ? 0 : code + 2), 160)};
}

/// Counts keys in the order of the text up to the requested one; true if it was found.
bool count_keys(const Json& value, const Json& object, const std::string& key, std::size_t& count) {
  if (!value.is_structured()) return false;
  for (const auto& [name, below] : value.items()) {
    if (value.is_object()) {
      if (&value == &object && name == key) return true;
      ++count;
    }
    if (count_keys(below, object, key, count)) return true;
  }
  return false;
}

}  // namespace

std::uint32_t JsonDocument::line_of(const Json& object, const std::string& key) const {
  std::size_t count = 0;
  count_keys(value, object, key, count);
  return count < key_lines.size() ? key_lines[count] : 0;
}

Result<JsonDocument> parse_json_object(std::string_view text, std::string_view where) {
  if (text.empty()) return make_error(std::string(where), "is empty, expected a JSON object");
  JsonDocument document{{}, std::string(where), {}};
  std::vector<std::set<std::string>> keys;
  std::optional<std::string> repeated;
  std::size_t values = 0;
  std::uint32_t line = 1;
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > kMaxDepth) throw TooLarge{fmt::format("nested deeper than {} levels", kMaxDepth)};
    if (++values > kMaxValues) throw TooLarge{fmt::format("contains more than {} values", kMaxValues)};
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event != Json::parse_event_t::key) return true;
    document.key_lines.push_back(line);
    if (keys.back().size() >= kMaxKeys)
      throw TooLarge{fmt::format("an object has more than {} keys in line {}", kMaxKeys, line)};
    if (!keys.back().insert(parsed.get<std::string>()).second && !repeated) repeated = parsed.get<std::string>();
    return true;
  };
  try {
    const CountingIterator begin{text.data(), &line}, end{text.data() + text.size(), &line};
    document.value = Json::parse(begin, end, watch, true, true);
    if (repeated)
      return make_error(document.where, fmt::format("the key \"{}\" is given twice", plain_text(*repeated)));
    if (!document.value.is_object())
      return make_error(document.where, "found " + shown(document.value) + ", expected a JSON object");
    return document;
  } catch (const TooLarge& limit) {
    return make_error(document.where, limit.what);
  } catch (const Json::exception& error) {  // invalid JSON, or a number out of the range of double
    return tl::unexpected<Error>(json_error(where, error));
  }
}

}  // namespace prism
