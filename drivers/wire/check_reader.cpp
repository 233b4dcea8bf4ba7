// SPDX-License-Identifier: MIT
// From a check's JSON to its rule.
#include "drivers/wire/check_reader.hpp"

#include <algorithm>
#include <bit>

namespace prism::wire {
namespace {

constexpr std::int64_t kFar = 8192;

void read_crc(const Section& s, CheckRule& rule) {
  CrcParameters parameters;
  parameters.width = static_cast<int>(s.whole("width", 3, 64));
  parameters.poly = s.bits("poly");
  parameters.init = s.bits("init", 0);
  parameters.reflect_in = s.flag("reflect_in", false);
  parameters.reflect_out = s.flag("reflect_out", parameters.reflect_in);
  parameters.xor_out = s.bits("xor_out", 0);
  rule.crc = std::make_shared<const Crc>(parameters);
  rule.pad_to = static_cast<std::uint32_t>(s.whole("pad_to", 1, 64, 1));
  rule.bits = parameters.width;
  rule.size = static_cast<std::uint8_t>((parameters.width + 7) / 8);
}

void read_stored(const Section& s, CheckRule& rule) {
  const std::string text = s.choice("text", {"no", "hex", "decimal"});
  const std::string mark = s.text("mark", "");
  if (text == "no") return;
  rule.stored = text == "hex" ? CheckRule::Stored::kHexText : CheckRule::Stored::kDecimalText;
  rule.covers_mark = s.flag("covers_mark", false);
  if (mark.size() != 1) return s.refuse("mark", "is not one character; expected the one in front of the check");
  rule.mark = mark[0];
  if (rule.stored == CheckRule::Stored::kHexText) rule.size = static_cast<std::uint8_t>(2 * rule.size);
}

}  // namespace

CheckRule read_check(const Section& s, bool big_endian) {
  CheckRule rule;
  const std::string kind = s.choice("kind", {"crc", "sum", "xor", "fletcher", "parity"}, true);
  rule.from = static_cast<int>(s.whole("from", -kFar, kFar, 0));
  rule.to = static_cast<int>(s.whole("to", -kFar, kFar, 0));
  rule.big_endian = s.byte_order("order", big_endian);
  rule.word = static_cast<std::uint8_t>(s.whole("word", 1, 4, 1));
  if (rule.word == 3) s.refuse("word", "3 is not 1, 2 or 4");
  rule.word_big_endian = s.byte_order("word_order", rule.big_endian);
  rule.negate = s.flag("negate", false);
  rule.size = rule.word;
  if (kind == "crc") {
    rule.sum = CheckRule::Sum::kCrc;
    read_crc(s, rule);
  } else {
    rule.sum = kind == "sum"        ? CheckRule::Sum::kSum
               : kind == "xor"      ? CheckRule::Sum::kXor
               : kind == "fletcher" ? CheckRule::Sum::kFletcher
                                    : CheckRule::Sum::kParity;
    rule.init = s.bits("init", 0);
    if (kind == "fletcher") rule.size = 2;
  }
  if (s.has("size")) rule.size = static_cast<std::uint8_t>(s.whole("size", 1, 8));
  rule.mask = s.bits("mask", ~std::uint64_t{0});
  if (kind != "crc") rule.bits = std::min(8 * rule.size, std::popcount(rule.mask));
  if (kind == "parity") {
    rule.bits = 1;
    rule.odd = s.flag("odd", true);
    if (std::popcount(rule.mask) != 1 || rule.mask > 0xFF) s.refuse("mask", "is not one bit of the byte at \"at\"");
  }
  read_stored(s, rule);
  if (rule.mark == 0) rule.at = static_cast<int>(s.whole("at", -kFar, kFar));
  return rule;
}

}  // namespace prism::wire
