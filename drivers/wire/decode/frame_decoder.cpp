// SPDX-License-Identifier: MIT
// Search for frames. All decisions use held_; feed() appends chunks to it in slices.
#include "drivers/wire/decode/frame_decoder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace prism::wire {

// Matches one message type.

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
  return std::any_of(kind.rejects.begin(), kind.rejects.end(), [&](const BitsRule& rule) {
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

namespace {

constexpr std::size_t kSliceBytes = 16 * 1024;
constexpr double kShortestTimeoutNs = 5e6;
/// The lock is lost after the length of this many of the longest frames without a good one.
constexpr std::uint64_t kFramesUntilLost = 8;

}  // namespace

FrameDecoder::FrameDecoder(FrameDescriptionPtr description)
    : description_(std::move(description)), maker_(description_) {
  byte_time_ns_ = description_->wire.byte_time_ns();
  const double longest_ns = byte_time_ns_ * description_->max_frame_bytes;
  timeout_ns_ = static_cast<std::int64_t>(std::max(kShortestTimeoutNs, 2 * longest_ns));
  lost_after_bytes_ = kFramesUntilLost * description_->max_frame_bytes;
  for (std::size_t k = 0; k < description_->kinds.size(); ++k) {
    const auto& sync = description_->kinds[k].sync;
    for (unsigned byte = 0; byte < 256; ++byte) {
      const bool fits = sync.empty() || sync.front().at != 0 || (byte & sync.front().mask) == sync.front().value;
      if (fits) kinds_by_first_byte_[byte] |= std::uint64_t{1} << k;
    }
  }
  const auto possible = [](std::uint64_t kinds) { return kinds != 0; };
  if (std::count_if(kinds_by_first_byte_.begin(), kinds_by_first_byte_.end(), possible) == 1) {
    const auto first = std::find_if(kinds_by_first_byte_.begin(), kinds_by_first_byte_.end(), possible);
    only_first_byte_ = static_cast<int>(first - kinds_by_first_byte_.begin());
  }
  held_.reserve(kSliceBytes + 2 * description_->max_frame_bytes);
}

void FrameDecoder::reset() {
  counters_.skipped_bytes += held_bytes();
  drop_held(held_.size());
  chunk_ends_.clear();
  before_held_ = -1;
  locked_ = in_run_ = false;
  last_kind_ = -1;
  maker_.reset();
}

void FrameDecoder::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns,
                        std::vector<DecodedMessage>& out) {
  if (bytes.empty()) return;
  expire(arrival_ns, out);
  last_arrival_ns_ = arrival_ns;
  counters_.bytes += bytes.size();
  chunk_ends_.push_back({counters_.bytes, arrival_ns});
  while (!bytes.empty()) {
    const auto slice = bytes.first(std::min(bytes.size(), kSliceBytes));
    held_.insert(held_.end(), slice.begin(), slice.end());
    scan(Mode::kMore, out);
    bytes = bytes.subspan(slice.size());
  }
}

void FrameDecoder::expire(std::int64_t now_ns, std::vector<DecodedMessage>& out) {
  if (!waiting() || now_ns - last_arrival_ns_ <= timeout_ns_) return;
  while (look_behind(out)) continue;
}

void FrameDecoder::finish(std::vector<DecodedMessage>& out) { scan(Mode::kEnd, out); }

bool FrameDecoder::look_behind(std::vector<DecodedMessage>& out) {
  std::size_t at = next_possible(std::min<std::size_t>(1, held_.size()));
  while (at < held_.size() && look_at(at, Mode::kSilent).match != Match::kYes) at = next_possible(at + 1);
  if (at >= held_.size()) return false;
  ++counters_.timeouts;
  skip(at);
  drop_held(at);
  scan(Mode::kMore, out);
  return waiting();
}

void FrameDecoder::scan(Mode mode, std::vector<DecodedMessage>& out) {
  std::size_t at = 0;
  while (at < held_.size()) {
    if (skip_trailer(at)) {
      ++at;
      continue;
    }
    if (const std::size_t possible = next_possible(at); possible != at) {
      skip(possible - at);
      at = possible;
      continue;
    }
    const Candidate candidate = look_at(at, mode);
    if (candidate.match == Match::kNeedMore && mode != Mode::kEnd) break;
    count(candidate);
    if (candidate.match != Match::kYes) {
      if (candidate.damaged > 0 && held_offset_ + at >= damaged_until_) {
        ++damaged_;
        damaged_until_ = held_offset_ + at + candidate.damaged;
      }
      skip(1);
      ++at;
      continue;
    }
    accept(at, candidate, out);
    at += candidate.length;
  }
  drop_held(at);
}

std::size_t FrameDecoder::next_possible(std::size_t at) const {
  if (at >= held_.size()) return held_.size();
  if (only_first_byte_ >= 0) {
    if (held_[at] == only_first_byte_) return at;
    const void* found = std::memchr(held_.data() + at, only_first_byte_, held_.size() - at);
    return found == nullptr ? held_.size()
                            : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - held_.data());
  }
  while (at < held_.size() && kinds_by_first_byte_[held_[at]] == 0) ++at;
  return at;
}

/// The first matching message type wins. If a type needs more bytes, the search stops here: it might match with them.
FrameDecoder::Candidate FrameDecoder::try_kinds(std::size_t at, Mode mode, FrameView& view) {
  Candidate candidate;
  const std::span<const std::uint8_t> bytes(held_.data() + at, held_.size() - at);
  const int before = at > 0 ? held_[at - 1] : before_held_;
  for (std::uint64_t left = kinds_by_first_byte_[bytes[0]]; left != 0; left &= left - 1) {
    const int k = std::countr_zero(left);
    const MessageType& kind = description_->kinds[static_cast<std::size_t>(k)];
    const MatchResult result = match_frame(kind, bytes, before, view);
    candidate.bad_length += result.match == Match::kBadLength ? 1 : 0;
    candidate.bad_body += result.match == Match::kBadBody ? 1 : 0;
    candidate.refused += result.match == Match::kRefused ? 1 : 0;
    candidate.bad_check += result.match == Match::kBadCheck ? 1 : 0;
    if (result.match == Match::kBadCheck && kind.roles.carries_gyro()) candidate.damaged = std::max(result.length, 1u);
    const bool more = result.match == Match::kNeedMore;
    if (result.match != Match::kYes && !more) continue;
    candidate.match = result.match;
    candidate.kind = k;
    candidate.length = result.length;
    if (!more || mode == Mode::kMore) break;
  }
  return candidate;
}

FrameDecoder::Candidate FrameDecoder::look_at(std::size_t at, Mode mode) {
  Candidate candidate = try_kinds(at, mode, view_);
  if (mode == Mode::kEnd && candidate.match == Match::kNeedMore) ++candidate.bad_length;
  if (candidate.match != Match::kYes) return candidate;
  if (accepted_at_once(description_->kinds[static_cast<std::size_t>(candidate.kind)], held_offset_ + at))
    return candidate;
  bool need_more = false;
  if (confirmed(at, candidate, mode, need_more)) return candidate;
  candidate.match = need_more && mode != Mode::kEnd ? Match::kNeedMore : Match::kNoSync;
  candidate.unconfirmed = 1;
  return candidate;
}

/// True if no further frame needs to confirm a match of this message type here.
bool FrameDecoder::accepted_at_once(const MessageType& kind, std::uint64_t begin) const {
  if (kind.confirmations <= 1) return true;
  const bool follows = begin == last_good_end_ + trailer_at_;
  return locked_ && begin - last_good_end_ <= lost_after_bytes_ && (follows || !kind.weak);
}

/// Called once per position, when it is decided: a position examined again with more bytes is not counted twice.
void FrameDecoder::count(const Candidate& candidate) {
  counters_.bad_length += candidate.bad_length;
  counters_.bad_body += candidate.bad_body;
  counters_.refused += candidate.refused;
  counters_.bad_check += candidate.bad_check;
  counters_.unconfirmed += candidate.unconfirmed;
}

/// A weak frame is accepted if enough good frames follow directly, with the right counter steps.
bool FrameDecoder::confirmed(std::size_t at, const Candidate& candidate, Mode mode, bool& need_more) {
  const int needed = description_->kinds[static_cast<std::size_t>(candidate.kind)].confirmations;
  FrameView before = view_;
  Candidate last = candidate;
  for (int good = 1; good < needed; ++good) {
    at += last.length;
    for (const std::uint8_t byte : description_->kinds[static_cast<std::size_t>(last.kind)].trailer) {
      if (at < held_.size() && held_[at] == byte) ++at;
    }
    need_more = at >= held_.size();
    if (need_more) return false;
    FrameView behind;
    const Candidate next = try_kinds(at, mode, behind);
    need_more = next.match == Match::kNeedMore && mode != Mode::kEnd;
    if (next.match != Match::kYes || !counter_steps(before, last.kind, behind, next.kind)) return false;
    before = behind;
    last = next;
  }
  return true;
}

bool FrameDecoder::counter_steps(const FrameView& before, std::int32_t kind_before, const FrameView& behind,
                                 std::int32_t kind) const {
  const FieldList& first = description_->kinds[static_cast<std::size_t>(kind_before)].roles.counter;
  const FieldList& second = description_->kinds[static_cast<std::size_t>(kind)].roles.counter;
  if (first.empty() || second.empty() || description_->counter->step_varies) return true;
  const CounterRule& rule = *description_->counter;
  std::uint64_t ticks = behind.count(second.front()) - before.count(first.front());
  if (rule.modulus != 0) ticks = (ticks + (ticks > ~std::uint64_t{0} / 2 ? rule.modulus : 0)) % rule.modulus;
  return std::abs(static_cast<double>(ticks) - rule.ticks_per_frame) <= 0.25 * rule.ticks_per_frame;
}

bool FrameDecoder::skip_trailer(std::size_t at) {
  if (!in_run_ || last_kind_ < 0) return false;
  const std::vector<std::uint8_t>& trailer = description_->kinds[static_cast<std::size_t>(last_kind_)].trailer;
  if (trailer_at_ >= trailer.size() || held_[at] != trailer[trailer_at_]) return false;
  ++trailer_at_;
  return true;
}

void FrameDecoder::skip(std::size_t bytes) {
  if (bytes == 0) return;
  counters_.skipped_bytes += bytes;
  if (in_run_) ++counters_.resyncs;
  in_run_ = false;
}

void FrameDecoder::accept(std::size_t at, const Candidate& candidate, std::vector<DecodedMessage>& out) {
  const std::uint64_t offset = held_offset_ + at, end = offset + candidate.length;
  DecodedMessage& reading = out.emplace_back();
  if (maker_.make(candidate.kind, view_, in_run_, reading)) {
    reading.offset = offset;
    reading.length = candidate.length;
    reading.damaged = reading.has_gyro ? std::exchange(damaged_, 0) : 0;
    set_arrival(reading, end);
  } else {
    out.pop_back();
  }
  ++counters_.frames;
  counters_.out_of_range = maker_.out_of_range();
  locked_ = in_run_ = true;
  last_kind_ = candidate.kind;
  last_good_end_ = end;
  trailer_at_ = 0;
}

void FrameDecoder::set_arrival(DecodedMessage& reading, std::uint64_t end) const {
  reading.arrival_ns = last_arrival_ns_;
  for (const ChunkEnd& chunk : chunk_ends_) {
    if (chunk.end < end) continue;
    reading.behind = static_cast<std::uint32_t>(std::min<std::uint64_t>(chunk.end - end, ~std::uint32_t{0}));
    reading.arrival_ns = chunk.arrival_ns;
    if (chunk.end > end) reading.arrival_ns -= std::llround(byte_time_ns_ * static_cast<double>(chunk.end - end));
    return;
  }
}

std::int64_t FrameDecoder::chunk_arrival_ns(const DecodedMessage& reading) const {
  return reading.arrival_ns + std::llround(byte_time_ns_ * static_cast<double>(reading.behind));
}

void FrameDecoder::drop_held(std::size_t bytes) {
  if (bytes == 0) return;
  before_held_ = held_[bytes - 1];
  held_offset_ += bytes;
  if (!waiting()) {  // nearly always
    held_.clear();
    chunk_ends_.clear();
    return;
  }
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(bytes));
  const auto reaches = std::find_if(chunk_ends_.begin(), chunk_ends_.end(),
                                    [&](const ChunkEnd& chunk) { return chunk.end > held_offset_; });
  chunk_ends_.erase(chunk_ends_.begin(), reaches);
}

}  // namespace prism::wire
