// SPDX-License-Identifier: MIT
// Header bytes and known bits of a kind.
#include "drivers/wire/kind_strength.hpp"

#include <algorithm>
#include <bit>

namespace prism::wire {

void measure_header(FrameKind& kind) {
  std::sort(kind.sync.begin(), kind.sync.end(), [](const ByteRule& a, const ByteRule& b) { return a.at < b.at; });
  std::uint32_t header = 1;
  for (const ByteRule& rule : kind.sync) header = std::max(header, rule.at + 1);
  if (kind.length.form == LengthRule::Form::kField) {
    header = std::max(header, static_cast<std::uint32_t>(kind.length.field.at) + kind.length.field.size);
  }
  for (CheckRule& check : kind.checks) {
    const bool early =
        check.from >= 0 && check.to > 0 && check.at >= 0 && check.mark == 0 && check.to <= 8 && check.at < 8;
    check.in_header = early && kind.length.form == LengthRule::Form::kField;
    if (check.in_header)
      header =
          std::max({header, static_cast<std::uint32_t>(check.to), static_cast<std::uint32_t>(check.at) + check.size});
  }
  kind.header_bytes = header;
}

namespace {

/// Text has to parse; body rules fix bits of each byte they cover. Neither is a check: at most 16 bits are counted.
int body_bits(const FrameKind& kind) {
  const auto length = static_cast<int>(kind.length.min);
  int bits = kind.structure == Structure::kColumns ? 8 * length : 0;
  for (const BodyRule& rule : kind.body) {
    const int from = rule.from < 0 ? length + rule.from : rule.from;
    const int to = rule.to <= 0 ? length + rule.to : std::min(rule.to, length);
    bits += std::popcount(rule.mask) * std::max(to - from, 0);
  }
  return std::min(bits, 16);
}

}  // namespace

void weigh(FrameKind& kind) {
  for (const CheckRule& check : kind.checks) kind.check_bits += check.bits;
  kind.known_bits = kind.check_bits + 8 * static_cast<int>(kind.length.terminator.size());
  for (const ByteRule& rule : kind.sync) kind.known_bits += std::popcount(rule.mask);
  kind.known_bits += body_bits(kind);
  kind.weak = kind.known_bits < 16;
  const int frames = (31 + kind.known_bits) / std::max(kind.known_bits, 1);
  kind.confirmations = kind.check_bits >= 16 ? 1 : std::clamp(frames, 2, 16);
}

}  // namespace prism::wire
