// SPDX-License-Identifier: MIT
// Reading one JSON object, key by key.
#include "drivers/wire/json_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace prism::wire {

namespace {

const Json kNothing;
const Json kEmptyObject = Json::object();

std::string joined(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, ", ")); }

std::optional<std::uint64_t> parse_unsigned(std::string_view text) {
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  if (hex) text.remove_prefix(2);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::string found(const Json& json) {
  if (json.is_null()) return "nothing";
  if (json.is_object()) return "an object";
  if (json.is_array()) return fmt::format("an array of {}", json.size());
  std::string text = json.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > 40) text = text.substr(0, 37) + "...";
  return text;
}

Section::Section(Problems& problems, const Json& json, std::string pointer, std::string_view section)
    : problems_(&problems), json_(&json), pointer_(std::move(pointer)) {
  if (!json.is_object()) {
    problems_->add(pointer_, found(json) + " is not an object");
    json_ = &kEmptyObject;
    return;
  }
  const std::vector<std::string>& known = section_keys(section);
  for (const auto& [key, value] : json.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      problems_->add(this->pointer(key), fmt::format("unknown key; expected one of {}", joined(known)));
    }
  }
}

bool Section::has(const char* key) const { return json_->contains(key); }

std::string Section::pointer(std::string_view key) const {
  return key.empty() ? pointer_ : fmt::format("{}/{}", pointer_, key);
}

const Json* Section::find(const char* key) const {
  const auto it = json_->find(key);
  return it == json_->end() ? &kNothing : &*it;
}

Section Section::sub(const char* key, std::string_view section) const {
  return Section(*problems_, has(key) ? at(key) : kEmptyObject, pointer(key), section);
}

std::string Section::text(const char* key, std::optional<std::string> preset) const {
  const Json& json = at(key);
  if (json.is_string()) return json.get<std::string>();
  if (!has(key) && preset) return *preset;
  refuse(key, found(json) + " is not text");
  return {};
}

double Section::number(const char* key, double low, double high, std::optional<double> preset) const {
  const Json& json = at(key);
  if (!has(key) && preset) return *preset;
  const double value = json.is_number() ? json.get<double>() : NAN;
  if (value >= low && value <= high) return value;
  refuse(key, fmt::format("{} is not a number from {} to {}", found(json), low, high));
  return preset.value_or(low);
}

std::int64_t Section::whole(const char* key, std::int64_t low, std::int64_t high,
                            std::optional<std::int64_t> preset) const {
  const Json& json = at(key);
  if (!has(key) && preset) return *preset;
  if (json.is_number_integer() && !(json.is_number_unsigned() && json.get<std::uint64_t>() > INT64_MAX)) {
    const auto value = json.get<std::int64_t>();
    if (value >= low && value <= high) return value;
  }
  refuse(key, fmt::format("{} is not a whole number from {} to {}", found(json), low, high));
  return preset.value_or(low);
}

bool Section::flag(const char* key, bool preset) const {
  const Json& json = at(key);
  if (!has(key)) return preset;
  if (json.is_boolean()) return json.get<bool>();
  refuse(key, found(json) + " is neither true nor false");
  return preset;
}

std::string Section::choice(const char* key, std::initializer_list<const char*> choices, bool required) const {
  const Json& json = at(key);
  if (!has(key) && !required) return *choices.begin();
  if (json.is_string()) {
    for (const char* choice : choices) {
      if (json.get_ref<const std::string&>() == choice) return choice;
    }
  }
  refuse(key, fmt::format("{} is not one of {}", found(json), fmt::join(choices, ", ")));
  return *choices.begin();
}

std::optional<std::uint64_t> Section::unsigned_value(const Json& json) const {
  if (json.is_number_unsigned()) return json.get<std::uint64_t>();
  if (json.is_number_integer() && json.get<std::int64_t>() >= 0)
    return static_cast<std::uint64_t>(json.get<std::int64_t>());
  if (json.is_string()) return parse_unsigned(json.get_ref<const std::string&>());
  return std::nullopt;
}

std::uint64_t Section::bits(const char* key, std::optional<std::uint64_t> preset) const {
  if (!has(key) && preset) return *preset;
  if (const auto value = unsigned_value(at(key))) return *value;
  refuse(key, found(at(key)) + " is no unsigned number (a number, or text like \"0x1F\")");
  return preset.value_or(0);
}

std::vector<std::uint8_t> Section::bytes(const char* key, bool required) const {
  std::vector<std::uint8_t> result;
  const Json& json = at(key);
  if (!has(key) && !required) return result;
  const std::string text = json.is_string() ? json.get<std::string>() : std::string("?");
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == ' ') {
      ++i;
      continue;
    }
    const int high = hex_digit(text[i]);
    const int low = i + 1 < text.size() ? hex_digit(text[i + 1]) : -1;
    if (high < 0 || low < 0) {
      refuse(key, found(json) + " is not text of hex bytes like \"A5 5A\"");
      return {};
    }
    result.push_back(static_cast<std::uint8_t>(high * 16 + low));
    i += 2;
  }
  if (result.empty()) refuse(key, found(json) + " holds no byte; expected at least one");
  return result;
}

std::vector<double> Section::numbers(const char* key) const {
  std::vector<double> result;
  const Json& json = at(key);
  const auto good = [](const Json& one) { return one.is_number() && std::isfinite(one.get<double>()); };
  if (json.is_array() && !json.empty() && std::all_of(json.begin(), json.end(), good)) {
    for (const Json& one : json) result.push_back(one.get<double>());
    return result;
  }
  refuse(key, found(json) + " is not an array of numbers");
  return {0};
}

std::vector<std::uint64_t> Section::bit_list(const char* key) const {
  std::vector<std::uint64_t> result;
  const Json& json = at(key);
  const Json list = json.is_array() ? json : Json::array({json});
  for (const Json& one : list) {
    if (const auto value = unsigned_value(one)) result.push_back(*value);
  }
  if (result.size() != list.size() || result.empty()) {
    refuse(key, found(json) + " is neither an unsigned number nor an array of them");
    result.assign(1, 0);
  }
  return result;
}

std::vector<std::string> Section::texts(const char* key) const {
  std::vector<std::string> result;
  const Json& json = at(key);
  const Json list = json.is_array() ? json : Json::array({json});
  for (const Json& one : list) {
    if (one.is_string()) result.push_back(one.get<std::string>());
  }
  if (result.size() != list.size() || result.empty()) {
    refuse(key, found(json) + " is neither text nor an array of texts");
    result.assign(1, "");
  }
  return result;
}

}  // namespace prism::wire
