// SPDX-License-Identifier: MIT
// One frame seen through its kind: where each field stands (items, blocks and columns too) and what it says.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "compensation/sample.hpp"
#include "drivers/wire/description/frame_kind.hpp"

namespace prism::wire {

/// Reused from frame to frame; holds no memory of its own and does not outlive the bytes it looks at.
class FrameView {
 public:
  static constexpr std::size_t kMaxElements = 64;  ///< items, blocks or columns that a kind can name

  /// False where the frame's structure is broken: items that run over its end, a wrong number of columns.
  bool look_at(const FrameKind& kind, std::span<const std::uint8_t> frame) {
    kind_ = &kind;
    frame_ = frame;
    return kind.structure == Structure::kPlain || locate();
  }

  /// The first byte of a binary field; null where this frame does not carry the field.
  const std::uint8_t* find(const Field& field) const;
  /// False where this frame does not carry the field.
  bool present(int field) const;
  /// The field's bits; 0 where it is absent or no whole number.
  std::uint64_t bits(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    const std::uint8_t* at = at_once(f);
    return at != nullptr ? load_bits(f, at) : bits_elsewhere(f);
  }
  /// The number before scaling; kUnknown where it is absent or no number.
  double raw(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    const std::uint8_t* at = at_once(f);
    return at != nullptr ? load_number(f, at) : raw_elsewhere(f);
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
  /// Nearly every field: at a place from the start, without a condition. Null: it has to be looked for.
  const std::uint8_t* at_once(const Field& field) const {
    const bool plain = kind_->structure == Structure::kPlain && field.when.field < 0 && field.at >= 0;
    return plain && static_cast<std::size_t>(field.at) + field.size <= frame_.size() ? frame_.data() + field.at
                                                                                     : nullptr;
  }
  std::uint64_t bits_elsewhere(const Field& field) const;
  double raw_elsewhere(const Field& field) const;
  bool locate();
  bool locate_items();
  bool locate_blocks();
  bool locate_columns();
  bool holds(const Condition& condition) const;
  const std::uint8_t* find_in_item(const Field& field) const;
  double raw_text(const Field& field) const;
  std::uint64_t text_bits(const Field& field) const;
  std::span<const std::uint8_t> column(const Field& field) const;

  const FrameKind* kind_ = nullptr;
  std::span<const std::uint8_t> frame_;
  std::array<std::span<const std::uint8_t>, kMaxElements> elements_;  ///< of items, blocks or columns
};

}  // namespace prism::wire
