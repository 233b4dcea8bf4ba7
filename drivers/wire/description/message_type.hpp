// SPDX-License-Identifier: MIT
// One message type, compiled to tables: sync, length, checks, fields. decode/ and encode/ use them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/wire/description/check.hpp"
#include "drivers/wire/description/field.hpp"

namespace prism::wire {

/// (byte at `at` & mask) == value. For the sync and for body rules of single bytes.
struct ByteRule {
  std::uint32_t at;
  std::uint8_t value, mask;
};

struct LengthRule {
  enum class LengthType { kFixed, kField, kTerminated } form = LengthType::kFixed;
  std::uint32_t min = 0, max = 0;  ///< length of the frame in bytes; equal for kFixed
  std::int32_t add = 0;
  std::vector<std::uint8_t> terminator;  ///< kTerminated: the last bytes of the frame
  Field field;                           ///< kField: length = field + add
};

/// Every byte from..to (negative: from the end) has (byte & mask) == value: "bit 7 is clear".
struct BodyRule {
  int from = 0, to = 0;
  std::uint8_t mask = 0, value = 0;
};

/// (field & mask) == value.
struct BitsRule {
  int field;
  std::uint64_t mask, value;
};

/// Tag-length-value items from..to; `ids` are those used by fields.
struct ItemRule {
  int from = 0, to = 0;
  std::uint8_t id_size = 1, length_size = 1;
  bool length_first = false;  ///< {length, id, data}, else {id, length, data}
  bool length_includes_header = false;
  bool big_endian = true;
  std::vector<std::uint64_t> ids;
  std::vector<std::uint64_t> sent;  ///< ids written by an encoder, in this order; empty: all ids used by fields
};

/// Optional blocks selected by the bits of a mask field, in bit order; each has a fixed size.
struct BlockRule {
  int mask_field = -1;
  int from = 0;
  std::vector<std::uint32_t> sizes;
};

/// Columns of a text frame.
struct ColumnsRule {
  std::string separators;
  bool collapse = false;      ///< consecutive separators count as one (blanks)
  std::uint32_t columns = 0;  ///< exact number; 0: any
  std::uint32_t tail = 0;     ///< bytes at the end that are not columns: terminator, check without a mark
  char point = '.';           ///< decimal point; ',' in some countries
  std::string write;          ///< template of an encoder: text with {field} or {field:9.6} or {field:08x}
};

/// Indices into MessageType::fields. Nearly always one, which is then stored inline.
using FieldList = boost::container::small_vector<std::int32_t, 2>;

struct AxisRoles {
  FieldList gyro;
  boost::container::small_vector<BitsRule, 1> valid;  ///< the gyro's number is valid if all of them are true
};

/// Fields of a quantity that need not be in every frame.
struct ChannelFields {
  FieldList whole;
  int high = -1, low = -1;  ///< halves in consecutive frames

  bool any() const { return !whole.empty() || high >= 0 || low >= 0; }
};

/// Fields of this message type for each part of a DecodedMessage; the first one present in a frame is used.
struct MessageFields {
  FieldList counter, status, latency;
  /// As FrameDescription::channels.
  boost::container::small_vector<ChannelFields, 2> channels{ChannelFields(), ChannelFields()};
  boost::container::small_vector<AxisRoles, 1> axes;  ///< as FrameDescription::axes
  std::vector<BitsRule> corrected;                    ///< bits that mark a corrected frame of an output

  bool carries_gyro() const {
    return std::any_of(axes.begin(), axes.end(), [](const AxisRoles& axis) { return !axis.gyro.empty(); });
  }
  bool tells_anything() const {
    return carries_gyro() || !counter.empty() ||
           std::any_of(channels.begin(), channels.end(), [](const ChannelFields& channel) { return channel.any(); });
  }
};

/// Layout of the fields in a frame: at fixed positions, or by one of the rules.
enum class Structure : std::uint8_t { kPlain, kItems, kBlocks, kColumns };

/// Members in the order of use: those needed for a live frame are adjacent in memory.
struct MessageType {
  LengthRule length;
  boost::container::small_vector<ByteRule, 4> sync;
  int after = -1;                  ///< the byte before the frame; -1: any
  std::uint32_t header_bytes = 1;  ///< bytes needed to determine the length
  int confirmations = 1;           ///< good frames in a row before the first is accepted
  bool weak = false;  ///< recognised by fewer than 16 bits in total: every interruption requires confirmation again
  Structure structure = Structure::kPlain;
  std::vector<CheckRule> checks;
  std::vector<BodyRule> body;
  /// A frame contains no data if one is true, although its check is right (sync filler, start-up patterns).
  std::vector<BitsRule> rejects;
  std::vector<std::uint8_t> trailer;  ///< optional bytes after the frame (CR LF), not counted as damage
  std::vector<Field> fields;
  MessageFields roles;
  ItemRule items;      ///< kItems
  BlockRule blocks;    ///< kBlocks
  ColumnsRule text;    ///< kColumns
  int check_bits = 0;  ///< all checks together
  int known_bits = 0;  ///< checks, sync, terminator and at most 16 bits of body rules: all bits that identify a frame
  std::string name;

  /// Index of a field by its name, or -1.
  int field_index(std::string_view field) const {
    const auto it = std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == field; });
    return it == fields.end() ? -1 : static_cast<int>(it - fields.begin());
  }
};

}  // namespace prism::wire
