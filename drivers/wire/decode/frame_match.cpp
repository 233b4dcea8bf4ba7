// SPDX-License-Identifier: MIT
// Matches one message type.
#include "drivers/wire/decode/frame_match.hpp"

#include <algorithm>

namespace prism::wire {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// kYes, kNoSync, or kNeedMore if the bytes so far match and more are needed.
Match match_sync(const MessageType& kind, Bytes bytes) {
  for (const ByteRule& rule : kind.sync) {
    if (rule.at >= bytes.size()) return Match::kNeedMore;
    if ((bytes[rule.at] & rule.mask) != rule.value) return Match::kNoSync;
  }
  return bytes.size() < kind.header_bytes ? Match::kNeedMore : Match::kYes;
}

MatchResult terminated_length(const LengthRule& rule, Bytes bytes) {
  const Bytes window = bytes.first(std::min<std::size_t>(bytes.size(), rule.max));
  const auto found = std::search(window.begin(), window.end(), rule.terminator.begin(), rule.terminator.end());
  if (found == window.end()) {
    const bool open = bytes.size() < rule.max;
    return {open ? Match::kNeedMore : Match::kBadLength, rule.max};
  }
  const auto length =
      static_cast<std::uint32_t>(found - window.begin() + static_cast<std::ptrdiff_t>(rule.terminator.size()));
  return {length < rule.min ? Match::kBadLength : Match::kYes, length};
}

MatchResult length_of(const LengthRule& rule, Bytes bytes) {
  if (rule.form == LengthRule::LengthType::kFixed) return {Match::kYes, rule.max};
  if (rule.form == LengthRule::LengthType::kTerminated) return terminated_length(rule, bytes);
  const auto field = static_cast<std::int64_t>(load_bits(rule.field, bytes.data() + rule.field.at) & 0xFFFFFFFF);
  const std::int64_t length = field + rule.add;
  if (length < rule.min || length > rule.max) return {Match::kBadLength};
  return {Match::kYes, static_cast<std::uint32_t>(length)};
}

bool body_holds(const BodyRule& rule, Bytes frame) {
  const auto length = static_cast<int>(frame.size());
  const int from = rule.from < 0 ? length + rule.from : rule.from;
  const int to = rule.to <= 0 ? length + rule.to : rule.to;
  for (int i = std::max(from, 0); i < std::min(to, length); ++i) {
    if ((frame[static_cast<std::size_t>(i)] & rule.mask) != rule.value) return false;
  }
  return true;
}

bool refused(const MessageType& kind, const FrameView& view) {
  return std::any_of(kind.rejects.begin(), kind.rejects.end(), [&](const RejectRule& rule) {
    return view.present(rule.field) && (view.bits(rule.field) & rule.mask) == rule.value;
  });
}

}  // namespace

MatchResult match_frame(const MessageType& kind, Bytes bytes, int before, FrameView& view) {
  if (kind.after >= 0 && before != kind.after) return {Match::kNoSync};
  const Match sync = match_sync(kind, bytes);
  if (sync != Match::kYes) return {sync, kind.length.max};
  for (const CheckRule& check : kind.checks) {
    if (check.in_header && !check_holds(check, bytes.first(kind.header_bytes))) return {Match::kBadCheck};
  }
  MatchResult result = length_of(kind.length, bytes);
  if (result.match != Match::kYes) return result;
  if (result.length > bytes.size()) return {Match::kNeedMore, result.length};
  const Bytes frame = bytes.first(result.length);
  for (const BodyRule& rule : kind.body) {
    if (!body_holds(rule, frame)) return {Match::kBadBody};
  }
  for (const CheckRule& check : kind.checks) {
    if (!check.in_header && !check_holds(check, frame))
      return {Match::kBadCheck, static_cast<std::uint32_t>(frame.size())};
  }
  if (!view.look_at(kind, frame)) return {Match::kBadBody};
  if (refused(kind, view)) return {Match::kRefused};
  return result;
}

}  // namespace prism::wire
