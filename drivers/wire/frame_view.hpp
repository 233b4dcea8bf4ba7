// SPDX-License-Identifier: MIT
// One frame seen through its kind: where each field stands (items, blocks and columns too) and what it says.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compensation/sample.hpp"
#include "drivers/wire/frame_kind.hpp"

namespace prism {

/// Reused from frame to frame; holds no memory of its own and does not outlive the bytes it looks at.
class FrameView {
 public:
  static constexpr std::size_t kMaxPlaces = 64;  ///< items, blocks or columns that a kind can name

  /// False where the frame's structure is broken: items that run over its end, a wrong number of columns.
  bool look_at(const FrameKind& kind, std::span<const std::uint8_t> frame) {
    kind_ = &kind;
    frame_ = frame;
    return !kind.has_structure() || locate();
  }

  /// The first byte of a binary field; null where this frame does not carry the field.
  const std::uint8_t* find(const Field& field) const {
    if (field.when.field >= 0 && !holds(field.when)) return nullptr;
    if (field.item >= 0) return find_in_item(field);
    const auto length = static_cast<std::int64_t>(frame_.size());
    const std::int64_t at = field.at >= 0 ? field.at : length + field.at;
    return at >= 0 && at + field.size <= length ? frame_.data() + at : nullptr;
  }

  bool present(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    return kind_->text.present ? !column(f).empty() : find(f) != nullptr;
  }
  /// The field's bits; 0 where it is absent or no whole number.
  std::uint64_t bits(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    if (kind_->text.present) return text_bits(f);
    const std::uint8_t* at = find(f);
    return at == nullptr ? 0 : load_bits(f, at);
  }
  /// The number before scaling; kUnknown where it is absent or no number.
  double raw(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    if (kind_->text.present) return raw_text(f);
    const std::uint8_t* at = find(f);
    return at == nullptr ? kUnknown : load_number(f, at);
  }
  /// The quantity that a raw number of the field stands for; kUnknown where it is not finite or out of its range.
  double scaled(int field, double raw) const {
    const Scaling& scaling = kind_->fields[static_cast<std::size_t>(field)].scaling;
    const double value = scaling.apply(raw);
    return scaling.admits(value) ? value : kUnknown;
  }
  /// The quantity; kUnknown where it is absent, no number, not finite or out of its range.
  double value(int field) const { return scaled(field, raw(field)); }

 private:
  bool locate();
  bool locate_items();
  bool locate_blocks();
  bool locate_columns();
  bool holds(const Condition& condition) const {
    if (!present(condition.field)) return false;
    std::uint64_t value = bits(condition.field);
    if (condition.modulus != 0) value %= condition.modulus;
    value &= condition.mask;
    for (const std::uint64_t admitted : condition.values) {
      if (value == admitted) return true;
    }
    return false;
  }
  const std::uint8_t* find_in_item(const Field& field) const;
  double raw_text(const Field& field) const;
  std::uint64_t text_bits(const Field& field) const;
  std::span<const std::uint8_t> column(const Field& field) const;

  const FrameKind* kind_ = nullptr;
  std::span<const std::uint8_t> frame_;
  std::array<std::span<const std::uint8_t>, kMaxPlaces> places_;  ///< of items, blocks or columns
};

}  // namespace prism
