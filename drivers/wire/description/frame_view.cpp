// SPDX-License-Identifier: MIT
// Finds items, blocks and columns in a frame, and reads fields there.
#include "drivers/wire/description/frame_view.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "drivers/wire/description/field.hpp"

namespace prism::wire {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::size_t absolute(int at, std::size_t length) {
  return at >= 0 ? static_cast<std::size_t>(at) : length - static_cast<std::size_t>(-at);
}

std::uint64_t load(Bytes bytes, std::size_t at, unsigned size, bool big_endian) {
  return big_endian ? load_big(bytes.data() + at, size) : load_little(bytes.data() + at, size);
}

bool is_separator(const ColumnsRule& rule, std::uint8_t byte) {
  return rule.separators.find(static_cast<char>(byte)) != std::string::npos;
}

}  // namespace

bool FrameView::locate() {
  elements_.fill({});
  if (kind_->structure == Structure::kItems) return locate_items();
  if (kind_->structure == Structure::kColumns) return locate_columns();
  return locate_blocks();
}

bool FrameView::locate_items() {
  const ItemRule& rule = kind_->items;
  const std::size_t header = std::size_t{rule.id_size} + rule.length_size;
  std::size_t at = absolute(rule.from, frame_.size());
  const std::size_t stop = rule.to == 0 ? frame_.size() : absolute(rule.to, frame_.size());
  if (at > stop || stop > frame_.size()) return false;
  while (at < stop) {
    if (stop - at < header) return false;
    const std::size_t id_at = rule.length_first ? at + rule.length_size : at;
    const std::size_t length_at = rule.length_first ? at : at + rule.id_size;
    const std::uint64_t id = load(frame_, id_at, rule.id_size, rule.big_endian);
    std::uint64_t length = load(frame_, length_at, rule.length_size, rule.big_endian);
    if (rule.length_includes_header) {
      if (length < header) return false;
      length -= header;
    }
    at += header;
    if (length > stop - at) return false;
    for (std::size_t i = 0; i < rule.ids.size(); ++i) {
      if (rule.ids[i] == id && elements_[i].data() == nullptr) elements_[i] = frame_.subspan(at, length);
    }
    at += length;
  }
  return true;
}

bool FrameView::locate_blocks() {
  const BlockRule& rule = kind_->blocks;
  const std::uint64_t mask = bits(rule.mask_field);
  std::size_t at = absolute(rule.from, frame_.size());
  for (std::size_t i = 0; i < rule.sizes.size(); ++i) {
    if ((mask >> i & 1) == 0) continue;
    if (at > frame_.size() || rule.sizes[i] > frame_.size() - at) return false;
    elements_[i] = frame_.subspan(at, rule.sizes[i]);
    at += rule.sizes[i];
  }
  return true;
}

bool FrameView::locate_columns() {
  const ColumnsRule& rule = kind_->text;
  std::size_t count = 0;
  std::size_t start = 0;
  if (frame_.size() < rule.tail) return false;
  const std::size_t end = frame_.size() - rule.tail;
  for (std::size_t i = 0; i <= end; ++i) {
    if (i < end && !is_separator(rule, frame_[i])) continue;
    const bool empty = i == start;
    if (!(rule.collapse && empty)) {
      if (count >= kMaxElements) return false;
      elements_[count++] = frame_.subspan(start, i - start);
    }
    start = i + 1;
  }
  return (rule.columns == 0 || count == rule.columns) && decimals_hold();
}

bool FrameView::decimals_hold() const {
  return std::all_of(kind_->fields.begin(), kind_->fields.end(), [&](const Field& field) {
    if (field.decimals < 0) return true;
    const Bytes text = column(field);
    const auto point = std::find(text.begin(), text.end(), static_cast<std::uint8_t>(kind_->text.point));
    const std::ptrdiff_t digits = point == text.end() ? 0 : text.end() - point - 1;
    return text.empty() || digits == field.decimals;
  });
}

bool FrameView::holds(const Condition& condition) const {
  std::uint64_t value = bits(condition.field);
  if (value == 0 && !present(condition.field)) return false;
  if (condition.modulus != 0) value %= condition.modulus;
  value &= condition.mask;
  for (const std::uint64_t admitted : condition.values) {
    if (value == admitted) return true;
  }
  return false;
}

const std::uint8_t* FrameView::find_elsewhere(const Field& field) const {
  if (field.when.field >= 0 && !holds(field.when)) return nullptr;
  if (field.item >= 0) return find_in_item(field);
  const auto length = static_cast<std::int64_t>(frame_.size());
  const std::int64_t at = field.at >= 0 ? field.at : length + field.at;
  if (at < 0 || at + field.size > length) return nullptr;
  const std::uint8_t* first = frame_.data() + at;
  return field.is_hex() && !are_hex_digits(first, field.size) ? nullptr : first;
}

bool FrameView::present(int field) const {
  const Field& f = kind_->fields[static_cast<std::size_t>(field)];
  return kind_->structure == Structure::kColumns ? !column(f).empty() : find(f) != nullptr;
}

std::uint64_t FrameView::bits_elsewhere(const Field& f) const {
  if (kind_->structure == Structure::kColumns) return text_bits(f);
  const std::uint8_t* at = find_elsewhere(f);
  return at == nullptr ? 0 : load_bits(f, at);
}

std::uint64_t FrameView::count(int field) const {
  const Field& f = kind_->fields[static_cast<std::size_t>(field)];
  if (f.type == NumberType::kUnsigned || f.type == NumberType::kSigned) return bits(field);
  const double number = raw(field);
  const bool counts = number >= 0 && number < 0x1p64 && number == std::floor(number);
  return counts ? static_cast<std::uint64_t>(number) : 0;
}

double FrameView::raw_elsewhere(const Field& f) const {
  if (kind_->structure == Structure::kColumns) return raw_text(f);
  const std::uint8_t* at = find_elsewhere(f);
  return at == nullptr ? kUnknown : load_number(f, at);
}

const std::uint8_t* FrameView::find_in_item(const Field& field) const {
  const Bytes element = elements_[static_cast<std::size_t>(field.item)];
  const std::int64_t size = static_cast<std::int64_t>(element.size());
  const std::int64_t at = field.at >= 0 ? field.at : size + field.at;
  return at >= 0 && at + field.size <= size ? element.data() + at : nullptr;
}

Bytes FrameView::column(const Field& field) const {
  const auto index = static_cast<std::size_t>(field.at);
  if (index >= kMaxElements || (field.when.field >= 0 && !holds(field.when))) return {};
  Bytes text = elements_[index];
  while (!text.empty() && text.front() == ' ') text = text.subspan(1);
  while (!text.empty() && text.back() == ' ') text = text.first(text.size() - 1);
  if (field.is_hex()) return text.size() == field.size && are_hex_digits(text.data(), field.size) ? text : Bytes{};
  return text;
}

double FrameView::raw_text(const Field& field) const {
  const Bytes text = column(field);
  const char* first = reinterpret_cast<const char*>(text.data());
  const char* last = first + text.size();
  if (text.empty()) return kUnknown;
  if (field.is_hex()) return load_number(field, text.data());
  if (field.type == NumberType::kHexText) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(first, last, value, 16);
    return error == std::errc{} && end == last ? static_cast<double>(value) : kUnknown;
  }
  return parse_decimal({first, text.size()}, kind_->text.point);
}

std::uint64_t FrameView::text_bits(const Field& field) const {
  if (field.is_hex()) {
    const Bytes text = column(field);
    return text.empty() ? 0 : load_bits(field, text.data());
  }
  const double number = raw_text(field);
  return number >= 0 && number < 18446744073709549568.0 ? static_cast<std::uint64_t>(number) : 0;
}

}  // namespace prism::wire
