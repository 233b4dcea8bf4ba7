// SPDX-License-Identifier: MIT
#include "drivers/wire/encode/frame_editor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "drivers/wire/encode/frame_encoder.hpp"

namespace prism::wire {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// "e+002": fmt prints at least two digits, devices one to three.
std::string exponent_like(std::string_view found, std::string_view printed) {
  std::string text(1, found.front());
  found.remove_prefix(1), printed.remove_prefix(1);
  if (printed.front() == '-' || found.front() == '+') text += printed.front();
  const std::size_t digits = found.size() - (is_digit(found.front()) ? 0 : 1);
  std::string_view number = printed.substr(1);
  while (number.size() > std::max<std::size_t>(digits, 1) && number.front() == '0') number.remove_prefix(1);
  return text + std::string(digits > number.size() ? digits - number.size() : 0, '0') + std::string(number);
}

std::string_view characters(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::string print_like(std::string_view found, double number, char point, bool with_plus) {
  const std::size_t exponent = std::min(found.find_first_of("eE"), found.size());
  const std::string_view mantissa = found.substr(0, exponent);
  const std::size_t dot = mantissa.find(point);
  const std::size_t decimals = dot == std::string_view::npos ? 0 : mantissa.size() - dot - 1;
  const bool has_exponent = exponent < found.size();
  std::string text = has_exponent ? fmt::format("{:.{}e}", std::abs(number), decimals)
                                  : fmt::format("{:.{}f}", std::abs(number), decimals);
  const std::size_t end = std::min(text.find('e'), text.size());
  const bool is_zero = text.find_first_of("123456789") >= end;
  std::replace(text.begin(), text.end(), '.', point);
  if (has_exponent) text = text.substr(0, end) + exponent_like(found.substr(exponent), text.substr(end));
  const bool is_signed = !found.empty() && !is_digit(found.front()) && found.front() != point;
  const std::string_view digits = found.substr(is_signed ? 1 : 0);
  std::string sign;
  if (std::signbit(number) && !is_zero) {
    sign = "-";
  } else if (with_plus || (is_signed && found.front() == '+')) {
    sign = "+";
  }
  const bool zeros = digits.size() > 1 && digits[0] == '0' && is_digit(digits[1]);
  if (zeros && sign.size() + text.size() < found.size()) text.insert(0, found.size() - sign.size() - text.size(), '0');
  return sign + text;
}

void FrameEditor::begin(std::int32_t kind, std::span<const std::uint8_t> frame) {
  kind_ = &description_->kinds[static_cast<std::size_t>(kind)];
  frame_.assign(frame.begin(), frame.end());
  view_.look_at(*kind_, frame_);
  if (kind_->structure == Structure::kColumns) {
    for (std::size_t i = 1; i < frame_.size(); ++i)
      has_plus_ = has_plus_ || (frame_[i] == '+' &&
                                kind_->text.separators.find(static_cast<char>(frame_[i - 1])) != std::string::npos);
  }
  const bool text = std::any_of(kind_->checks.begin(), kind_->checks.end(),
                                [](const CheckRule& check) { return check.stored == CheckRule::Stored::kHexText; });
  if (!text) return;
  before_ = frame_;
  store_checks(*kind_, before_);
  if (before_ != frame_) lower_case_ = true;  // the check is right: only the case of its digits can differ
}

double FrameEditor::put(std::size_t axis, double value) {
  before_ = frame_;
  double found = kUnknown;
  for (const int index : kind_->roles.axes[axis].gyro) {
    if (!view_.present(index)) continue;
    const bool written = write(static_cast<std::size_t>(index), value, description_->axes[axis].wrap);
    if (!written || !view_.look_at(*kind_, frame_) || std::isnan(view_.value(index))) {
      frame_ = before_;
      view_.look_at(*kind_, frame_);
      return kUnknown;
    }
    if (std::isnan(found)) found = view_.value(index);
  }
  return found;
}

bool FrameEditor::write(std::size_t index, double value, double wrap) {
  const Field& field = kind_->fields[index];
  const bool whole = field.type == NumberType::kSigned || field.type == NumberType::kUnsigned;
  double raw = field.scaling.invert(value);
  if (whole) raw = std::nearbyint(raw);
  if (wrap != 0) {  // into the range of the field: 0 to wrap, or around 0
    const double turn = wrap / std::abs(field.scaling.scale);
    const bool centred =
        field.type == NumberType::kSigned || field.type == NumberType::kFloat32 || field.type == NumberType::kFloat64;
    const double low = centred && field.scaling.admits(field.scaling.apply(-turn / 2)) ? -turn / 2 : 0;
    raw -= turn * std::floor((raw - low) / turn);
  }
  if (!std::isfinite(raw)) return false;
  if (view_.is_text() || field.type == NumberType::kDigits) return write_text(field, raw);
  std::uint8_t* const at = frame_.data() + (view_.find(field) - frame_.data());
  store_number(field, at, raw);
  return !whole || load_number(field, at) == raw;  // else it is beyond the field's limits
}

// Keeps the width of the column where blanks before the number allow it.
bool FrameEditor::write_text(const Field& field, double raw) {
  if (field.type == NumberType::kHexText || field.is_hex()) return false;
  const std::span<const std::uint8_t> place =
      view_.is_text() ? view_.column(field) : std::span<const std::uint8_t>(view_.find(field), field.size);
  std::size_t at = static_cast<std::size_t>(place.data() - frame_.data()), length = place.size();
  const std::size_t first = view_.is_text() ? 0 : characters(place).find_first_not_of(' ');
  std::string text = print_like(characters(place).substr(first), raw, kind_->text.point, has_plus_);
  if (!view_.is_text()) {
    if (text.size() > length) return false;
    text.insert(0, length - text.size(), ' ');
  } else if (at > 0 && frame_[at - 1] == ' ') {
    const bool separates = kind_->text.separators.find(' ') != std::string::npos;
    while (text.size() > length && at > 1 && frame_[at - 1] == ' ' && (!separates || frame_[at - 2] == ' '))
      --at, ++length;
    if (text.size() < length) text.insert(0, length - text.size(), ' ');
  }
  if (text.size() != length && kind_->length.form == LengthRule::LengthType::kFixed) return false;
  const auto begin = frame_.begin() + static_cast<std::ptrdiff_t>(at);
  frame_.insert(frame_.erase(begin, begin + static_cast<std::ptrdiff_t>(length)), text.begin(), text.end());
  return frame_.size() <= kind_->length.max;
}

bool FrameEditor::mark() {
  for (const ValidRule& rule : kind_->roles.corrected) {
    const Field& field = kind_->fields[static_cast<std::size_t>(rule.field)];
    if (!view_.present(rule.field)) return false;
    store_bits(field, frame_.data() + (view_.find(field) - frame_.data()),
               (view_.bits(rule.field) & ~rule.mask) | rule.value);
  }
  return !kind_->roles.corrected.empty();
}

std::span<const std::uint8_t> FrameEditor::finish() {
  store_checks(*kind_, frame_, lower_case_);
  return frame_;
}

}  // namespace prism::wire
