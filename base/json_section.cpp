// SPDX-License-Identifier: MIT
#include "base/json_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/escape.hpp"
#include "base/json_document.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"

namespace prism {
namespace {

const Json kEmptyObject = Json::object();

// A key as a step of a JSON pointer: "/key".
std::string pointer_step(std::string_view key) { return (Json::json_pointer() / plain_text(key)).to_string(); }

/// The line of a key between two texts; empty if it is unknown.
std::string line_text(const JsonDocument& document, const Json& object, const std::string& key, const char* before,
                      const char* after = "") {
  const std::uint32_t line = document.line_of(object, key);
  return line > 0 ? fmt::format("{}{}{}", before, line, after) : "";
}

std::string expected_text(std::string_view type, Range range) {
  if (range.min == range.max) return fmt::format("{:.10g}", range.min);
  return fmt::format("{} within {:.10g} to {:.10g}", type, range.min, range.max);
}

std::optional<std::uint64_t> unsigned_value(const Json& json) {
  if (json.is_number_unsigned()) return json.get<std::uint64_t>();
  if (!json.is_string()) return std::nullopt;
  std::string_view text = json.get_ref<const std::string&>();
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  if (hex) text.remove_prefix(2);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The first key or string in a value that breaks the rule for long texts, or nullptr. At most 32 levels deep
/// (parse_json_object).
const std::string* unprintable_text(const Json& value) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    return follows(TextRule::kLongText, text) ? nullptr : &text;
  }
  if (!value.is_structured()) return nullptr;
  for (auto item = value.begin(); item != value.end(); ++item) {
    if (value.is_object() && !follows(TextRule::kLongText, item.key())) return &item.key();
    if (const std::string* text = unprintable_text(*item)) return text;
  }
  return nullptr;
}

}  // namespace

Section::Section(const JsonDocument& document)
    : Section(document.value, "", std::make_shared<State>(State{&document, {}, {}, {}})) {}

Section::Section(const Json& object, std::string pointer, std::shared_ptr<State> state)
    : object_(&object), pointer_(std::move(pointer)), state_(std::move(state)) {
  state_->sections.emplace_back(object_, pointer_);
}

Section Section::top() const { return {state_->document->value, "", state_}; }

Section Section::below(const Json& object, const std::string& key) const {
  return {object, pointer_ + "/" + key, state_};
}

const Json* Section::look(const std::string& key) const {
  state_->asked[object_].insert(key);
  const auto found = object_->find(key);
  return found == object_->end() ? nullptr : &*found;
}

const Json* Section::take(const std::string& key, bool required) const {
  const Json* found = look(key);
  if (found != nullptr || !required || !good()) return found;
  std::vector<std::string> others;
  for (const auto& [name, value] : object_->items()) {
    if (!state_->asked[object_].contains(name)) others.push_back(name);
  }
  const std::string near = nearest_name(key, others);
  std::string what = fmt::format("\"{}\" is missing", key);
  if (!near.empty())
    what +=
        fmt::format("; found \"{}\"{}", plain_text(near), line_text(*state_->document, *object_, near, " in line "));
  fail("", std::move(what));
  return nullptr;
}

bool Section::is_object(const std::string& key) const {
  const Json* value = look(key);
  return value != nullptr && value->is_object();
}

bool Section::is_array(const std::string& key) const {
  const Json* value = look(key);
  return value != nullptr && value->is_array();
}

std::vector<std::string> Section::removed(KeyFile file, std::span<const RemovedKey> table) const {
  std::vector<std::string> warnings;
  for (const RemovedKey& key : table) {
    if (key.file == file) mark_removed(*object_, pointer_, key.path, key, warnings);
  }
  return warnings;
}

void Section::mark_removed(const Json& value, const std::string& pointer, std::string_view path, const RemovedKey& key,
                           std::vector<std::string>& warnings) const {
  const std::string_view step = path.substr(0, path.find('/'));
  if (!value.is_structured()) return;
  const bool any_depth = step == "**";
  if (any_depth) mark_removed(value, pointer, path.substr(step.size() + 1), key, warnings);
  for (const auto& [name, below] : value.items()) {
    if (!any_depth && step != "*" && step != name) continue;
    const std::string place = pointer + pointer_step(name);
    if (any_depth || step.size() < path.size()) {
      mark_removed(below, place, any_depth ? path : path.substr(step.size() + 1), key, warnings);
      continue;
    }
    state_->asked[&value].insert(name);
    const std::string what = fmt::format("removed in prism 0.4{}; {}",
                                         line_text(*state_->document, value, name, " (line ", ")"), key.instead);
    if (!key.stops) {
      warnings.push_back(fmt::format("{}:{}: {}", state_->document->where, plain_text(place, 120), what));
    } else if (!state_->error) {
      state_->error = Error{fmt::format("{}:{}", state_->document->where, plain_text(place, 120)), what};
    }
  }
}

std::vector<std::string> Section::names(TextRule rule) const {
  std::vector<std::string> names;
  for (const auto& [name, value] : object_->items()) {
    look(name);
    if (follows(rule, name)) {
      names.push_back(name);
    } else {
      fail(name, fmt::format("found the name \"{}\", expected {}", shortened(name), rule_text(rule)));
    }
  }
  return names;
}

std::string Section::where() const {
  return pointer_.empty() ? state_->document->where : state_->document->where + ":" + pointer_;
}

void Section::fail(const std::string& key, std::string what) const {
  if (state_->error) return;
  const std::string pointer = plain_text(key.empty() ? pointer_ : pointer_ + "/" + key, 120);
  state_->error = Error{state_->document->where + (pointer.empty() ? "" : ":" + pointer), std::move(what)};
}

template <class T, class Read>
T Section::read(const std::string& key, const std::optional<T>& otherwise, T harmless, Read&& convert) const {
  const Json* value = take(key, !otherwise);
  if (value == nullptr) return otherwise.value_or(harmless);
  std::optional<T> result = convert(*value);
  return result ? *result : otherwise.value_or(harmless);
}

double Section::number(const std::string& key, Range range, std::optional<double> otherwise) const {
  return read<double>(key, otherwise, std::clamp(0.0, range.min, range.max), [&](const Json& value) {
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (number >= range.min && number <= range.max) return std::optional(number);
    fail(key, fmt::format("found {}, expected {}", shown(value), expected_text("a number", range)));
    return std::optional<double>();
  });
}

std::int64_t Section::integer(const std::string& key, Range range, std::optional<std::int64_t> otherwise) const {
  const auto harmless = static_cast<std::int64_t>(std::clamp(0.0, range.min, range.max));
  return read<std::int64_t>(key, otherwise, harmless, [&](const Json& value) -> std::optional<std::int64_t> {
    const double number = value.is_number_integer() ? value.get<double>() : std::nan("");
    if (number >= range.min && number <= range.max) return value.get<std::int64_t>();
    fail(key, fmt::format("found {}, expected {}", shown(value), expected_text("an integer", range)));
    return std::nullopt;
  });
}

bool Section::boolean(const std::string& key, std::optional<bool> otherwise) const {
  return read<bool>(key, otherwise, false, [&](const Json& value) -> std::optional<bool> {
    if (value.is_boolean()) return value.get<bool>();
    fail(key, fmt::format("found {}, expected true or false", shown(value)));
    return std::nullopt;
  });
}

std::string Section::raw_text(const std::string& key, std::optional<std::string> otherwise) const {
  return read<std::string>(key, otherwise, "", [&](const Json& value) -> std::optional<std::string> {
    if (value.is_string()) return value.get<std::string>();
    fail(key, fmt::format("found {}, expected a string in quotes", shown(value)));
    return std::nullopt;
  });
}

std::string Section::text(const std::string& key, std::optional<std::string> otherwise, TextRule rule) const {
  std::string text = raw_text(key, otherwise);
  if (!has(key) || follows(rule, text)) return text;
  fail(key, fmt::format("found {}, expected {}", shown(Json(text)), rule_text(rule)));
  return otherwise.value_or("");
}

std::uint64_t Section::bits(const std::string& key, std::optional<std::uint64_t> otherwise) const {
  return read<std::uint64_t>(key, otherwise, 0, [&](const Json& value) {
    const std::optional<std::uint64_t> number = unsigned_value(value);
    if (!number) fail(key, fmt::format("found {}, expected an unsigned number like 31 or \"0x1F\"", shown(value)));
    return number;
  });
}

std::vector<std::uint8_t> Section::bytes(const std::string& key, bool required) const {
  const Json* value = take(key, required);
  if (value == nullptr) return {};
  std::vector<std::uint8_t> bytes = hex_bytes(value->is_string() ? value->get<std::string>() : std::string());
  if (bytes.empty()) fail(key, fmt::format("found {}, expected bytes in hex like \"A5 5A\"", shown(*value)));
  return bytes;
}

std::vector<double> Section::numbers(const std::string& key, Range range, bool required) const {
  std::vector<double> result;
  const Json* array = take(key, required);
  if (array == nullptr) return result;
  if (!array->is_array()) {
    fail(key, fmt::format("found {}, expected an array of numbers", shown(*array)));
    return result;
  }
  for (std::size_t i = 0; i < array->size(); ++i) {
    const Json& value = (*array)[i];
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= range.min && number <= range.max)) {
      fail(fmt::format("{}/{}", key, i),
           fmt::format("found {}, expected {}", shown(value), expected_text("a number", range)));
      return {};
    }
    result.push_back(number);
  }
  return result;
}

template <class T, class Read>
std::vector<T> Section::one_or_more(const std::string& key, bool required, const char* what, Read&& convert) const {
  std::vector<T> result;
  const Json* value = take(key, required);
  if (value == nullptr) return result;
  const std::size_t count = value->is_array() ? value->size() : 1;
  for (std::size_t i = 0; i < count; ++i) {
    std::optional<T> one = convert(value->is_array() ? (*value)[i] : *value);
    if (one) result.push_back(std::move(*one));
  }
  if (count == 0 || result.size() != count) {
    fail(key, fmt::format("found {}, expected {} or an array of at least one", shown(*value), what));
    return {};
  }
  return result;
}

std::vector<std::string> Section::texts(const std::string& key, bool required) const {
  return one_or_more<std::string>(key, required, "a string", [](const Json& value) {
    const bool fits = value.is_string() && follows(TextRule::kLongText, value.get_ref<const std::string&>());
    return fits ? std::optional(value.get<std::string>()) : std::nullopt;
  });
}

std::vector<std::uint64_t> Section::bit_list(const std::string& key) const {
  return one_or_more<std::uint64_t>(key, true, "an unsigned number like 31 or \"0x1F\"", unsigned_value);
}

std::size_t Section::choice(const std::string& key, std::span<const char* const> choices,
                            std::optional<std::size_t> otherwise) const {
  return read<std::size_t>(key, otherwise, 0, [&](const Json& value) -> std::optional<std::size_t> {
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (value == choices[i]) return i;
    }
    fail(key, fmt::format("found {}, expected \"{}\"", shown(value), fmt::join(choices, "\" or \"")));
    return std::nullopt;
  });
}

std::size_t Section::explained_choice(const std::string& key, std::initializer_list<Choice> choices) const {
  return read<std::size_t>(key, std::nullopt, 0, [&](const Json& value) -> std::optional<std::size_t> {
    std::string expected;
    for (const Choice* choice = choices.begin(); choice != choices.end(); ++choice) {
      if (value == choice->name) return choice - choices.begin();
      expected += choice == choices.begin() ? "" : choice + 1 == choices.end() ? " or " : ", ";
      expected += fmt::format("\"{}\" ({})", choice->name, choice->meaning);
    }
    fail(key, fmt::format("found {}, expected {}", shown(value), expected));
    return std::nullopt;
  });
}

Section Section::object(const std::string& key, bool required) const {
  const Json* value = take(key, required);
  if (value != nullptr && !value->is_object()) {
    fail(key, fmt::format("found {}, expected an object {{...}}", shown(*value)));
    value = nullptr;
  }
  return below(value != nullptr ? *value : kEmptyObject, key);
}

std::vector<Section> Section::objects(const std::string& key, bool required) const {
  std::vector<Section> result;
  const Json* array = take(key, required);
  if (array == nullptr) return result;
  if (!array->is_array()) fail(key, fmt::format("found {}, expected an array of objects", shown(*array)));
  if (!good()) return result;
  for (std::size_t i = 0; i < array->size(); ++i) {
    if (!(*array)[i].is_object()) {
      fail(fmt::format("{}/{}", key, i), fmt::format("found {}, expected an object {{...}}", shown((*array)[i])));
      return {};
    }
    result.push_back(below((*array)[i], fmt::format("{}/{}", key, i)));
  }
  return result;
}

Json Section::any(const std::string& key) const {
  const Json* value = look(key);
  if (value == nullptr) return Json();
  if (const std::string* text = unprintable_text(*value)) {
    fail(key, fmt::format("contains the text \"{}\", expected {}", shortened(*text), rule_text(TextRule::kLongText)));
    return Json();
  }
  return *value;
}

void Section::reject_unknown(const Json& object, const std::string& pointer) const {
  const std::set<std::string>& asked = state_->asked[&object];
  for (const auto& [key, value] : object.items()) {
    if (asked.contains(key)) continue;
    const std::vector<std::string> known(asked.begin(), asked.end());
    const std::string near = nearest_name(key, known);
    const std::string hint = !near.empty()   ? fmt::format("did you mean \"{}\"?", near)
                             : known.empty() ? "expected none"
                                             : fmt::format("expected one of {}", fmt::join(known, ", "));
    state_->error =
        Error{fmt::format("{}:{}{}", state_->document->where, plain_text(pointer, 120), pointer_step(key)),
              fmt::format("unknown key{}; {}", line_text(*state_->document, object, key, " in line "), hint)};
    return;
  }
}

Result<void> Section::finish() const {
  for (const auto& [object, pointer] : state_->sections) {
    if (good()) reject_unknown(*object, pointer);
  }
  if (state_->error) return tl::unexpected<Error>(*state_->error);
  return {};
}

}  // namespace prism
