// SPDX-License-Identifier: MIT
#include "compensation/json_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "compensation/plain_text.hpp"

namespace prism {
namespace {

using nlohmann::json;

const json kEmptyObject = json::object();

constexpr int kMaxDepth = 32;  // a file of a million brackets must not recurse a million deep when it is shown or freed

// nlohmann says "[…] parse error at line 3, column 5: syntax error while parsing value - unexpected …"; keep the place
// and the reason.
Error json_error(std::string_view where, const json::exception& error) {
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

// A key as a step of a JSON pointer (RFC 6901).
std::string pointer_step(std::string_view key) {
  std::string step;
  for (const char c : plain_text(key)) step += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return step;
}

std::string span_text(Range range) { return fmt::format("within {:.10g} to {:.10g}", range.min, range.max); }

}  // namespace

std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  return text.size() > 40 ? text.substr(0, 37) + "..." : text;
}

Result<json> parse_json_object(std::string_view text, std::string_view where) {
  std::vector<std::set<std::string>> keys;
  std::optional<std::string> repeated;
  bool too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t event, json& parsed) {
    too_deep = too_deep || depth > kMaxDepth;
    if (too_deep) return false;
    if (event == json::parse_event_t::object_start) keys.emplace_back();
    if (event == json::parse_event_t::object_end) keys.pop_back();
    if (event == json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second && !repeated) {
      repeated = parsed.get<std::string>();
    }
    return true;
  };
  try {
    json value = json::parse(text.begin(), text.end(), watch, true, true);
    if (too_deep) return refuse(std::string(where), fmt::format("nested deeper than {} levels", kMaxDepth));
    if (repeated)
      return refuse(std::string(where), fmt::format("the key \"{}\" is given twice", plain_text(*repeated)));
    if (!value.is_object()) return refuse(std::string(where), "found " + shown(value) + ", expected a JSON object");
    return value;
  } catch (const json::exception& error) {  // no JSON, or a number beyond double
    return tl::unexpected<Error>(json_error(where, error));
  }
}

Section::Section(const json& object, std::string where)
    : Section(object, std::move(where) + ":", std::make_shared<State>()) {}

Section::Section(const json& object, std::string where, std::shared_ptr<State> state)
    : object_(&object), where_(std::move(where)), state_(std::move(state)) {
  state_->sections.emplace_back(object_, where_);
}

bool Section::has(const char* key) const { return object_->contains(key); }

const json* Section::take(const char* key, bool required) {
  const auto found = object_->find(key);
  if (found == object_->end()) {
    if (required) fail("", fmt::format("\"{}\" is missing", key));
    return nullptr;
  }
  state_->used.emplace(object_, key);
  return &*found;
}

void Section::fail(const std::string& key, std::string what) {
  if (state_->error) return;
  std::string place = where_;
  if (!key.empty()) place += "/" + key;
  if (!place.empty() && place.back() == ':') place.pop_back();
  state_->error = Error{place, std::move(what)};
}

template <class T, class Read>
T Section::read(const char* key, const std::optional<T>& otherwise, Read&& convert) {
  const json* value = take(key, !otherwise);
  if (value == nullptr) return otherwise.value_or(T{});
  std::optional<T> result = convert(*value);
  return result ? *result : otherwise.value_or(T{});
}

double Section::number(const char* key, Range range, std::optional<double> otherwise) {
  return read<double>(key, otherwise, [&](const json& value) -> std::optional<double> {
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (number >= range.min && number <= range.max) return number;
    fail(key, value.is_number() ? fmt::format("{} is not {}", shown(value), span_text(range))
                                : fmt::format("found {}, expected a number {}", shown(value), span_text(range)));
    return std::nullopt;
  });
}

std::int64_t Section::integer(const char* key, Range range, std::optional<std::int64_t> otherwise) {
  return read<std::int64_t>(key, otherwise, [&](const json& value) -> std::optional<std::int64_t> {
    if (!value.is_number_integer()) {
      fail(key, fmt::format("found {}, expected a whole number {}", shown(value), span_text(range)));
      return std::nullopt;
    }
    const double number = value.get<double>();
    if (number >= range.min && number <= range.max) return value.get<std::int64_t>();
    fail(key, fmt::format("{} is not {}", shown(value), span_text(range)));
    return std::nullopt;
  });
}

bool Section::boolean(const char* key, std::optional<bool> otherwise) {
  return read<bool>(key, otherwise, [&](const json& value) -> std::optional<bool> {
    if (value.is_boolean()) return value.get<bool>();
    fail(key, fmt::format("found {}, expected true or false", shown(value)));
    return std::nullopt;
  });
}

std::string Section::text(const char* key, std::optional<std::string> otherwise) {
  return read<std::string>(key, otherwise, [&](const json& value) -> std::optional<std::string> {
    if (value.is_string()) return value.get<std::string>();
    fail(key, fmt::format("found {}, expected a text in quotes", shown(value)));
    return std::nullopt;
  });
}

std::vector<double> Section::numbers(const char* key, Range range, bool required) {
  std::vector<double> result;
  const json* array = take(key, required);
  if (array == nullptr) return result;
  if (!array->is_array()) {
    fail(key, fmt::format("found {}, expected an array of numbers", shown(*array)));
    return result;
  }
  for (std::size_t i = 0; i < array->size(); ++i) {
    const json& value = (*array)[i];
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= range.min && number <= range.max)) {
      fail(fmt::format("{}/{}", key, i), fmt::format("found {}, expected a number {}", shown(value), span_text(range)));
      return {};
    }
    result.push_back(number);
  }
  return result;
}

std::vector<std::string> Section::texts(const char* key, bool required) {
  std::vector<std::string> result;
  const json* array = take(key, required);
  if (array == nullptr) return result;
  const bool fits =
      array->is_array() && std::all_of(array->begin(), array->end(), [](const json& v) { return v.is_string(); });
  if (!fits) {
    fail(key, fmt::format("found {}, expected an array of texts", shown(*array)));
    return result;
  }
  return array->get<std::vector<std::string>>();
}

std::size_t Section::choice(const char* key, std::span<const char* const> names, std::optional<std::size_t> otherwise) {
  return read<std::size_t>(key, otherwise, [&](const json& value) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (value == names[i]) return i;
    }
    fail(key, fmt::format("found {}, expected \"{}\"", shown(value), fmt::join(names, "\" or \"")));
    return std::nullopt;
  });
}

Section Section::object(const char* key, bool required) {
  const json* value = take(key, required);
  if (value != nullptr && !value->is_object()) {
    fail(key, fmt::format("found {}, expected an object {{...}}", shown(*value)));
    value = nullptr;
  }
  return {value != nullptr ? *value : kEmptyObject, where_ + "/" + key, state_};
}

std::vector<Section> Section::objects(const char* key, bool required) {
  std::vector<Section> result;
  const json* array = take(key, required);
  if (array == nullptr) return result;
  if (!array->is_array()) fail(key, fmt::format("found {}, expected an array of objects", shown(*array)));
  if (!good()) return result;
  for (std::size_t i = 0; i < array->size(); ++i) {
    if (!(*array)[i].is_object()) {
      fail(fmt::format("{}/{}", key, i), fmt::format("found {}, expected an object {{...}}", shown((*array)[i])));
      return {};
    }
    result.push_back(Section((*array)[i], fmt::format("{}/{}/{}", where_, key, i), state_));
  }
  return result;
}

json Section::any(const char* key) {
  const json* value = take(key, false);
  return value == nullptr ? json() : *value;
}

Result<void> Section::finish() {
  for (const auto& [object, where] : state_->sections) {
    for (const auto& [key, value] : object->items()) {
      if (state_->used.count({object, key}) == 0 && !state_->error) {
        state_->error = Error{where + "/" + pointer_step(key), "unknown key"};
      }
    }
  }
  if (state_->error) return tl::unexpected<Error>(*state_->error);
  return {};
}

}  // namespace prism
