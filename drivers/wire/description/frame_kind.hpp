// SPDX-License-Identifier: MIT
// One kind of frame, compiled: how it is recognised, checked and read. Tables only; decode/ and encode/ work on them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/wire/description/check.hpp"
#include "drivers/wire/description/field.hpp"

namespace prism::wire {

/// (byte at `at` & mask) == value. Used for the sync, and for body rules over single bytes.
struct ByteRule {
  std::uint32_t at = 0;
  std::uint8_t value = 0;
  std::uint8_t mask = 0xFF;
};

struct LengthRule {
  enum class Form { kFixed, kField, kTerminated } form = Form::kFixed;
  std::uint32_t min = 0, max = 0;  ///< bytes of the whole frame; equal for kFixed
  std::int32_t multiply = 1, add = 0;
  std::vector<std::uint8_t> terminator;  ///< kTerminated: the last bytes of the frame
  Field field;                           ///< kField: length = field * multiply + add
};

/// Every byte from..to (negative: from the end) has (byte & mask) == value: "bit 7 is clear".
struct BodyRule {
  int from = 0, to = 0;
  std::uint8_t mask = 0, value = 0;
};

/// A frame is no data where the condition holds although its check is right (sync filler, start-up patterns).
struct RefuseRule {
  int field = -1;
  std::uint64_t mask = 0, value = 0;
};

/// Tag-length-value items from..to; `ids` are those that fields ask for.
struct ItemRule {
  int from = 0, to = 0;
  std::uint8_t id_size = 1, length_size = 1;
  bool length_first = false;  ///< {length, id, data}, else {id, length, data}
  bool length_includes_header = false;
  bool big_endian = true;
  std::vector<std::uint64_t> ids;
  std::vector<std::uint64_t> sent;  ///< what an encoder puts in, in this order; empty: all ids that fields name
};

/// Optional blocks selected by the bits of a mask field, in bit order; each has a fixed size.
struct BlockRule {
  int mask_field = -1;
  int from = 0;
  std::vector<std::uint32_t> sizes;
};

/// A text frame's columns.
struct ColumnsRule {
  std::string separators;
  bool collapse = false;      ///< runs of separators count as one (blanks)
  std::uint32_t columns = 0;  ///< exactly so many; 0: any number
  char point = '.';           ///< before the decimals; ',' in some countries
  std::string write;          ///< what an encoder prints: text with {field} or {field:9.6} or {field:08x}
};

/// The gyro's number is valid where (field & mask) == value.
struct ValidRule {
  int field = -1;
  std::uint64_t mask = 0, value = 0;
};

/// Indices into FrameKind::fields. Nearly always one, which then stands here and not in a place of its own.
using FieldList = boost::container::small_vector<std::int32_t, 2>;

struct AxisRoles {
  FieldList gyro;
  boost::container::small_vector<ValidRule, 1> valid;
};

/// Of a quantity that not every frame need carry.
struct ChannelFields {
  FieldList whole;
  int high = -1, low = -1;  ///< halves in frames that follow each other

  bool any() const { return !whole.empty() || high >= 0 || low >= 0; }
};

/// Which fields of this kind feed which part of a Reading; the first that is present in a frame wins.
struct KindRoles {
  FieldList counter, status, latency;
  ChannelFields temperature, uhfo;
  std::vector<ChannelFields> sensors;                 ///< as FrameDescription::sensors
  boost::container::small_vector<AxisRoles, 1> axes;  ///< as FrameDescription::axes

  bool carries_gyro() const {
    return std::any_of(axes.begin(), axes.end(), [](const AxisRoles& axis) { return !axis.gyro.empty(); });
  }
  bool tells_anything() const {
    return carries_gyro() || !counter.empty() || temperature.any() || uhfo.any() ||
           std::any_of(sensors.begin(), sensors.end(), [](const ChannelFields& sensor) { return sensor.any(); });
  }
};

/// How fields stand in a frame: at fixed places, or in one of the forms that a rule describes.
enum class Structure : std::uint8_t { kPlain, kItems, kBlocks, kColumns };

/// In the order in which a frame is recognised and read: what a live frame needs stands close together.
struct FrameKind {
  LengthRule length;
  boost::container::small_vector<ByteRule, 4> sync;
  int after = -1;                  ///< the byte just before the frame; -1: any
  std::uint32_t header_bytes = 1;  ///< what must be there before the length is known
  int confirmations = 1;           ///< good frames in a row before the first is believed
  bool weak = false;               ///< recognised by less than 16 bits in all: every break asks for confirmation again
  Structure structure = Structure::kPlain;
  std::vector<CheckRule> checks;
  std::vector<BodyRule> body;
  std::vector<RefuseRule> refuse;
  std::vector<std::uint8_t> trailer;  ///< optional bytes behind the frame (CR LF) that are no damage
  std::vector<Field> fields;
  KindRoles roles;
  ItemRule items;      ///< kItems
  BlockRule blocks;    ///< kBlocks
  ColumnsRule text;    ///< kColumns
  int check_bits = 0;  ///< all checks together
  int known_bits = 0;  ///< checks, sync, terminator and (at most 16) body rules: what says "frame"
  std::string name;

  /// Index of a field by its name; -1 where the kind has none of that name.
  int field_index(std::string_view field) const {
    const auto it = std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == field; });
    return it == fields.end() ? -1 : static_cast<int>(it - fields.begin());
  }
};

}  // namespace prism::wire
