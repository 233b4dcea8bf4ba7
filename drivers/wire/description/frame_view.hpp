// SPDX-License-Identifier: MIT
// View of one frame by its message type: position (also in items, blocks and columns) and value of each field.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "compensation/sample.hpp"
#include "drivers/wire/description/message_type.hpp"

namespace prism::wire {

/// Reused for each frame; does not own memory and must not outlive the frame's bytes.
class FrameView {
 public:
  static constexpr std::size_t kMaxElements = 64;  ///< maximum items, blocks or columns of a message type

  /// Returns false if the structure is invalid: items beyond its end, a wrong number of columns.
  bool look_at(const MessageType& kind, std::span<const std::uint8_t> frame) {
    kind_ = &kind;
    frame_ = frame;
    return kind.structure == Structure::kPlain || locate();
  }

  std::span<const std::uint8_t> frame() const { return frame_; }
  bool is_text() const { return kind_->structure == Structure::kColumns; }
  /// The first byte of a field outside columns; null if this frame does not contain the field, or if a character of a
  /// field in hexadecimal digits is not one.
  const std::uint8_t* find(const Field& field) const {
    const std::uint8_t* at = at_once(field);
    return at != nullptr ? at : find_elsewhere(field);
  }
  /// False if this frame does not contain the field.
  bool present(int field) const;
  /// The field's bits; 0 if it is absent or not an integer.
  std::uint64_t bits(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    const std::uint8_t* at = at_once(f);
    return at != nullptr ? load_bits(f, at) : bits_elsewhere(f);
  }
  /// The value of a counter: its bits, or a printed number; 0 if it is absent or not an integer from 0.
  std::uint64_t count(int field) const;
  /// The number before scaling; kUnknown if it is absent or not a number.
  double raw(int field) const {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    const std::uint8_t* at = at_once(f);
    return at != nullptr ? load_number(f, at) : raw_elsewhere(f);
  }
  /// The quantity of a raw number of the field; kUnknown if it is not finite or out of range.
  double scaled(int field, double raw) const {
    const Conversion& scaling = kind_->fields[static_cast<std::size_t>(field)].scaling;
    const double value = scaling.apply(raw);
    return scaling.admits(value) ? value : kUnknown;
  }
  /// The quantity; kUnknown if it is absent, not a number, not finite or out of range.
  double value(int field) const { return scaled(field, raw(field)); }
  /// Of a text: the characters of a field, without blanks around them; empty if it is absent.
  std::span<const std::uint8_t> column(const Field& field) const;

 private:
  /// Fast path for most fields. Null: needs a search.
  const std::uint8_t* at_once(const Field& field) const {
    const auto at = static_cast<std::size_t>(field.at);
    return field.is_direct && at + field.size <= frame_.size() ? frame_.data() + at : nullptr;
  }
  const std::uint8_t* find_elsewhere(const Field& field) const;
  std::uint64_t bits_elsewhere(const Field& field) const;
  double raw_elsewhere(const Field& field) const;
  bool locate();
  bool locate_items();
  bool locate_blocks();
  bool locate_columns();
  bool decimals_hold() const;
  bool holds(const Condition& condition) const;
  const std::uint8_t* find_in_item(const Field& field) const;
  double raw_text(const Field& field) const;
  std::uint64_t text_bits(const Field& field) const;

  const MessageType* kind_ = nullptr;
  std::span<const std::uint8_t> frame_;
  std::array<std::span<const std::uint8_t>, kMaxElements> elements_;  ///< of items, blocks or columns
};

}  // namespace prism::wire
