// SPDX-License-Identifier: MIT
#include "drivers/wire/encode/frame_editor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/wire/encode/frame_encoder.hpp"

namespace prism::wire {

std::string print_like(std::string_view found, double number, char point, bool with_plus) {
  const std::size_t dot = std::min(found.find(point), found.size() - 1), decimals = found.size() - 1 - dot;
  const std::string_view digits = found.substr(found.find_first_not_of("+-"));
  const bool zeros = digits.size() > 1 && digits[0] == '0' && digits[1] != point;
  if (std::abs(number) <= 0.5 * std::pow(10, -static_cast<double>(decimals))) number = 0;  // without a sign
  const char* const form = with_plus || found[0] == '+' ? "{:+0{}.{}f}" : "{:0{}.{}f}";
  std::string text = fmt::format(fmt::runtime(form), number, zeros ? found.size() : 0, decimals);
  std::replace(text.begin(), text.end(), '.', point);
  return text;
}

void FrameEditor::begin(std::int32_t kind, std::span<const std::uint8_t> frame) {
  kind_ = &description_->kinds[static_cast<std::size_t>(kind)];
  frame_.assign(frame.begin(), frame.end());
  view_.look_at(*kind_, frame_);
  before_ = frame_;
  store_checks(*kind_, before_);
  if (before_ != frame_) lower_case_ = true;  // the check is right: only the case of its digits can differ
}

double FrameEditor::put(std::size_t axis, double value) {
  before_ = frame_;
  double found = kUnknown;
  for (const int index : kind_->roles.axes[axis].gyro) {
    if (std::isnan(view_.value(index))) continue;
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
  const double raw = raw_number(field, value, wrap);
  if (!std::isfinite(raw)) return false;
  if (view_.is_text() || field.type == NumberType::kDigits) return write_text(field, raw);
  std::uint8_t* const at = frame_.data() + (view_.find(field) - frame_.data());
  store_number(field, at, raw);
  return field.type == NumberType::kFloat32 || load_number(field, at) == raw;  // else it is beyond the field's limits
}

// Keeps the width of the column where blanks before the number allow it.
bool FrameEditor::write_text(const Field& field, double raw) {
  if (field.type == NumberType::kHexText || field.is_hex()) return false;
  const bool is_column = view_.is_text();
  const std::span<const std::uint8_t> place =
      is_column ? view_.column(field) : std::span<const std::uint8_t>(view_.find(field), field.size);
  const std::string_view found(reinterpret_cast<const char*>(place.data()), place.size());
  if (found.find_first_of("eE") != std::string_view::npos) return false;
  has_plus_ = has_plus_ || found.find('+') != std::string_view::npos;
  std::string text = print_like(found.substr(found.find_first_not_of(' ')), raw, kind_->text.point, has_plus_);
  std::size_t at = static_cast<std::size_t>(place.data() - frame_.data()), length = place.size();
  const bool is_aligned = !is_column || (at > 0 && frame_[at - 1] == ' ');
  const std::size_t kept = kind_->text.separators.find(' ') != std::string::npos ? 1 : 0;  // blanks
  while (is_column && text.size() > length && at > kept && frame_[at - 1] == ' ' && frame_[at - 1 - kept] == ' ')
    --at, ++length;
  if (is_aligned && text.size() < length) text.insert(0, length - text.size(), ' ');
  if (text.size() != length && (!is_column || kind_->length.form == LengthRule::LengthType::kFixed)) return false;
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
