// SPDX-License-Identifier: MIT
// Checks a complete description, one message type after the other.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <bitset>
#include <set>

#include "drivers/wire/description/keys.hpp"
#include "drivers/wire/description/text_template.hpp"

namespace prism::wire {
namespace {

using Bits = std::bitset<8 * kMaxFrameBytes>;  // of a frame

/// Position in a message type: negative positions count from its maximum length.
class MessageCheck {
 public:
  MessageCheck(const MessageType& kind, std::string key, const Section& whole)
      : kind_(kind), key_(std::move(key)), whole_(whole), length_(static_cast<int>(kind.length.max)) {}

  void check_all() {
    check_sync();
    for (const CheckRule& check : kind_.checks) check_coverage(check);
    if (kind_.structure == Structure::kColumns) {
      const std::string fault = template_fault(kind_);
      return fault.empty() ? void() : fail("/text/write", fault);
    }
    for (const Field& field : kind_.fields) check_inside(field);
    if (!whole_.good()) return;
    check_overlaps();
  }

 private:
  void fail(const std::string& at, const std::string& what) { whole_.fail(key_ + at, what); }

  void check_sync() {
    std::set<std::uint32_t> seen;
    for (const ByteRule& rule : kind_.sync) {
      if (rule.at >= kind_.length.min && kind_.length.form == LengthRule::LengthType::kFixed) {
        fail("/sync", fmt::format("byte {} is outside the frame of {} bytes", rule.at, kind_.length.min));
      }
      if (!seen.insert(rule.at).second) fail("/sync", fmt::format("sets byte {} twice", rule.at));
    }
    if (kind_.header_bytes > kind_.length.max)
      fail("/length", fmt::format("{} bytes are too short for the header of {}", kind_.length.max, kind_.header_bytes));
    if (kind_.sync.empty() && kind_.checks.empty() && kind_.structure != Structure::kColumns) {
      fail("", "has neither sync nor checks: any byte could start a frame");
    }
  }

  void check_coverage(const CheckRule& check) {
    if (check.separator != 0) return;
    const int at = absolute(check.at);
    const int from = absolute(check.from);
    const int to = check.to <= 0 ? length_ + check.to : check.to;
    if (at < 0 || at + check.size > length_) {
      return fail("/checks", fmt::format("a check of {} bytes at {} is outside the frame of {} bytes", check.size,
                                         check.at, length_));
    }
    if (from < 0 || to > length_ || to <= from) {
      return fail("/checks", fmt::format("covers {} to {}; expected a part of the frame of {} bytes", check.from,
                                         check.to, length_));
    }
    const bool inside = from < at + check.size && to > at;
    if (inside && check.sum != CheckRule::Sum::kParity) {
      const char* name = check.sum == CheckRule::Sum::kCrc ? "CRC" : "check";
      fail("/checks", fmt::format("the {} at {} is inside the bytes {} to {} that it covers", name, check.at,
                                  check.from, check.to));
    }
  }

  void check_inside(const Field& field) {
    const int limit = field.item < 0 ? length_
                      : kind_.blocks.sizes.empty()
                          ? 65535
                          : static_cast<int>(kind_.blocks.sizes[static_cast<std::size_t>(field.item)]);
    const int at = field.at < 0 ? limit + field.at : field.at;
    if (at < 0 || at + field.size > limit) {
      fail("/fields/" + field.name,
           fmt::format("bytes {} to {} are outside its {} bytes", field.at, field.at + field.size - 1, limit));
    }
  }

  void check_overlaps() {
    std::vector<std::pair<const Field*, Bits>> seen;
    const Bits checks = bits_of_checks();
    for (const Field& field : kind_.fields) {
      if (field.item >= 0 || field.when.field >= 0) continue;
      const Bits own = bits_of(field);
      if ((own & checks).any()) fail("/fields/" + field.name, "overlaps a check");
      for (const auto& [other, bits] : seen) {
        const Bits shared = own & bits;
        if (shared.any() && shared != own && shared != bits) {
          fail("/fields/" + field.name,
               fmt::format("overlaps a part of \"{}\"; expected none of it or all", other->name));
        }
      }
      seen.emplace_back(&field, own);
    }
  }

  Bits bits_of(const Field& field) const {
    Bits bits;
    const int at = absolute(field.at);
    for (unsigned bit = field.shift; bit < unsigned{field.shift} + field.bits; ++bit) {
      const unsigned byte_from_low = bit / field.group_bits;
      const unsigned position = field.size - 1u - byte_from_low;
      const auto byte = static_cast<std::size_t>(at) + (field.is_hex() ? position : field.order[position]);
      bits[byte * 8 + bit % field.group_bits] = true;
    }
    return bits;
  }

  Bits bits_of_checks() const {
    Bits bits;
    for (const CheckRule& check : kind_.checks) {
      const auto at = static_cast<std::size_t>(absolute(check.at)) * 8;
      if (check.separator != 0 || check.sum == CheckRule::Sum::kParity) continue;
      for (std::size_t bit = 0; bit < 8u * check.size; ++bit) bits.set(at + bit);
    }
    return bits;
  }

  int absolute(int at) const { return at < 0 ? length_ + at : at; }

  const MessageType& kind_;
  std::string key_;
  const Section& whole_;
  int length_;
};

/// The wire time of a frame times its rate must not exceed the capacity of a serial line.
void check_line_speed(const Section& whole, const FrameDescription& description, bool network) {
  double bytes = 0;
  for (const int k : description.sent_kinds) bytes += description.kinds[static_cast<std::size_t>(k)].length.min;
  if (description.sent_kinds.empty()) {
    if (description.carries_gyro()) whole.fail("gyro/axes", "the chosen field is in no message type");
    return;
  }
  double gyro_kinds = description.carries_gyro() ? 0 : static_cast<double>(description.sent_kinds.size());
  for (const int k : description.sent_kinds)
    gyro_kinds += description.kinds[static_cast<std::size_t>(k)].roles.carries_gyro() ? 1 : 0;
  if (gyro_kinds == 0) return whole.fail("send", "sends no message type with gyro data");
  const double load = bytes / gyro_kinds * description.rate_hz * description.wire.byte_time_ns() * 1e-9;
  if (load > 1 && !network) {
    whole.fail("rate_hz",
               fmt::format("{} frames/s of {:.0f} bytes need {:.0f} % of a line of {} baud; expected at most 100 %",
                           description.rate_hz, bytes / gyro_kinds, 100 * load, description.wire.baud));
  }
}

/// Without a counter frames are counted by arrival: each must contain every served axis.
void check_axes(const Section& whole, const FrameDescription& description) {
  if (description.counter || description.axes.size() < 2) return;
  for (const MessageType& kind : description.kinds) {
    const auto carries = [&](const AxisRoles& axis) { return !axis.gyro.empty(); };
    const auto carried = std::count_if(kind.roles.axes.begin(), kind.roles.axes.end(), carries);
    if (carried != 0 && carried != static_cast<std::ptrdiff_t>(description.axes.size())) {
      whole.fail("gyro/axes", fmt::format("message type {} contains {} of the {} served axes, and there is no counter: "
                                          "their times are not known; expected one axis",
                                          kind.name, carried, description.axes.size()));
    }
  }
}

void warn(FrameDescription& description) {
  for (const MessageType& kind : description.kinds) {
    int sync_bits = 0;
    for (const ByteRule& rule : kind.sync) sync_bits += std::popcount(rule.mask);
    const bool findable = kind.structure == Structure::kColumns;
    if (kind.check_bits < 16 && sync_bits <= 8 && !findable) {
      description.warnings.push_back(fmt::format(
          "message type {}: {} bits of sync and {} bits of checks can occur inside its own body; requires {} good "
          "frames in a row",
          kind.name, sync_bits, kind.check_bits, kind.confirmations));
    }
  }
  if (!description.carries_gyro()) return;
  if (description.gyro.meaning != RateEncoding::kRate || description.axis_names.size() > 1) {
    description.warnings.push_back(
        "the frame cannot prove the unit and meaning of the gyro's number: they are the device's set-up");
  }
}

void check_references(const Section& whole, const FrameDescription& description) {
  for (const TestVector& vector : description.test_vectors) {
    const auto kind = std::find_if(description.kinds.begin(), description.kinds.end(),
                                   [&](const MessageType& k) { return k.name == vector.kind; });
    if (!vector.kind.empty() && kind == description.kinds.end()) {
      whole.fail("vectors",
                 fmt::format("vector \"{}\" names kind \"{}\", which does not exist", vector.name, vector.kind));
    }
  }
  std::set<std::string> names;
  for (const MessageType& kind : description.kinds) {
    if (!names.insert(kind.name).second)
      whole.fail("kinds", fmt::format("two message types are named \"{}\"", kind.name));
  }
}

}  // namespace

void check_description(const Section& whole, FrameDescription& description, bool network) {
  for (std::size_t k = 0; k < description.kinds.size(); ++k) {
    MessageCheck(description.kinds[k], fmt::format("kinds/{}", k), whole).check_all();
  }
  check_references(whole, description);
  if (whole.good()) check_line_speed(whole, description, network);
  if (whole.good()) check_axes(whole, description);
  if (whole.good()) warn(description);
}

}  // namespace prism::wire
