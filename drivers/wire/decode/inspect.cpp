// SPDX-License-Identifier: MIT
#include "drivers/wire/decode/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

#include "base/plain_text.hpp"

namespace prism::wire {
namespace {

// Variants of a check.

using Frame = std::span<const std::uint8_t>;

constexpr std::size_t kLeast = 10, kUsed = 64;
constexpr int kLastBegin = 8;
constexpr std::array<std::uint64_t, 4> kPolynomials8 = {0x07, 0x31, 0x9B, 0x2F};
constexpr std::array<std::uint64_t, 4> kPolynomials16 = {0x1021, 0x8005, 0x3D65, 0xC867};
constexpr std::array<std::uint64_t, 4> kPolynomials32 = {0x04C11DB7, 0x1EDC6F41, 0xA833982B, 0x741B8CD7};

struct Candidates {
  std::vector<Frame> frames;  ///< the first kUsed
  std::size_t count = 0;
};

// Frames whose sync, length and body fit, checked or not.
Candidates candidates_of(const MessageType& kind, Frame bytes) {
  MessageType unchecked = kind;
  unchecked.checks.clear();
  Candidates found;
  FrameView view;
  for (std::size_t at = 0; at < bytes.size();) {
    const MatchResult result = match_frame(unchecked, bytes.subspan(at), at > 0 ? bytes[at - 1] : -1, view);
    if (result.match != Match::kYes || result.length == 0) {
      ++at;
      continue;
    }
    if (found.frames.size() < kUsed) found.frames.push_back(bytes.subspan(at, result.length));
    ++found.count;
    at += result.length;
  }
  return found;
}

// A candidate may be damaged, or not a frame.
bool fits(const CheckRule& rule, const std::vector<Frame>& frames) {
  std::size_t failed = 0;
  for (const Frame frame : frames) {
    failed += !check_holds(rule, frame);
    if (failed * 5 > frames.size()) return false;
  }
  return true;
}

struct Variant {
  CheckRule rule;
  std::string keys;  ///< of the description
};

std::vector<Variant> orders_of(const CheckRule& rule) {
  std::vector<Variant> all = {{rule, ""}};
  if (rule.size < 2 || rule.stored != CheckRule::Stored::kBinary) return all;
  Variant other{rule, fmt::format("\"order\": \"{}\"", rule.big_endian ? "little" : "big")};
  other.rule.big_endian = !rule.big_endian;
  all.push_back(other);
  return all;
}

// The same polynomial first.
std::vector<Variant> crcs_of(const CheckRule& rule) {
  const CrcParameters own = rule.crc->parameters();
  const std::uint64_t ones = own.width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << own.width) - 1;
  std::vector<std::uint64_t> polynomials = {own.poly};
  const auto& usual = own.width == 8 ? kPolynomials8 : own.width == 32 ? kPolynomials32 : kPolynomials16;
  if (own.width == 8 || own.width == 16 || own.width == 32)
    polynomials.insert(polynomials.end(), usual.begin(), usual.end());
  std::vector<Variant> all;
  for (const std::uint64_t poly : polynomials) {
    for (const std::uint64_t init : {own.init, std::uint64_t{0}, ones}) {
      for (const bool reflect : {own.reflect_in, !own.reflect_in}) {
        for (const std::uint64_t out : {own.xor_out, std::uint64_t{0}, ones}) {
          Variant variant{rule, fmt::format("\"poly\": \"0x{:X}\", \"init\": \"0x{:X}\", \"reflect_in\": {}, "
                                            "\"reflect_out\": {}, \"xor_out\": \"0x{:X}\"",
                                            poly, init, reflect, reflect, out)};
          variant.rule.crc = std::make_shared<const Crc>(CrcParameters{own.width, poly, init, reflect, reflect, out});
          all.push_back(std::move(variant));
        }
      }
    }
  }
  return all;
}

std::vector<Variant> algorithms_of(const CheckRule& rule) {
  if (rule.sum == CheckRule::Sum::kCrc) return crcs_of(rule);
  std::vector<Variant> all;
  if (rule.sum == CheckRule::Sum::kSum) {
    all.push_back({rule, fmt::format("\"negate\": {}", !rule.negate)});
    all.back().rule.negate = !rule.negate;
  }
  return all;
}

// Other bytes: begin 0 to 8, end as described or before the check.
std::vector<Variant> ranges_of(const CheckRule& rule) {
  std::vector<Variant> all;
  for (int from = 0; from <= kLastBegin; ++from) {
    for (const int to : {rule.to, rule.at}) {
      if ((from == rule.from && to == rule.to) || (to > 0 && to <= from)) continue;
      std::string keys = from != rule.from ? fmt::format("\"from\": {}", from) : "";
      if (to != rule.to) keys += fmt::format("{}\"to\": {}", keys.empty() ? "" : ", ", to);
      all.push_back({rule, keys});
      all.back().rule.from = from;
      all.back().rule.to = to;
    }
  }
  return all;
}

std::string joined(const std::string& a, const std::string& b) { return a.empty() || b.empty() ? a + b : a + ", " + b; }

/// Keys of the first variant that fits, those with one difference first; empty: none.
std::string search(const CheckRule& rule, const std::vector<Frame>& frames) {
  const auto try_all = [&](const std::vector<Variant>& variants) -> std::string {
    for (const Variant& variant : variants) {
      for (const Variant& ordered : orders_of(variant.rule)) {
        if (fits(ordered.rule, frames)) return joined(variant.keys, ordered.keys);
      }
    }
    return {};
  };
  if (std::string keys = try_all({{rule, ""}}); !keys.empty()) return keys;
  if (std::string keys = try_all(ranges_of(rule)); !keys.empty()) return keys;
  if (std::string keys = try_all(algorithms_of(rule)); !keys.empty()) return keys;
  for (const Variant& range : ranges_of(rule)) {
    if (std::string keys = try_all(algorithms_of(range.rule)); !keys.empty()) return joined(range.keys, keys);
  }
  return {};
}

/// "sync and length fit, the check does not: …"
std::string mismatch_text(const CheckRule& rule, const std::vector<Frame>& frames, bool searched) {
  const Frame frame = frames.front();
  std::vector<std::uint8_t> computed(frame.begin(), frame.end());
  store_check(rule, computed);
  const auto end = [&](int at) { return at > 0 ? at : static_cast<int>(frame.size()) + at; };
  const auto stored = [&](Frame of) {
    const auto at = static_cast<std::size_t>(std::max(0, rule.at >= 0 ? rule.at : end(rule.at)));
    return fmt::format("{:02X}",
                       fmt::join(of.subspan(std::min(at, of.size()),
                                            std::min<std::size_t>(rule.size, of.size() - std::min(at, of.size()))),
                                 " "));
  };
  std::string text = fmt::format("sync and length fit, the check does not: found {}, computed {} over bytes {} to {}",
                                 stored(frame), stored(computed), rule.from, end(rule.to) - 1);
  if (!searched) return text;
  const std::string keys = search(rule, frames);
  return text + (keys.empty() ? "; no usual variant fits" : "; it fits with " + keys);
}

bool can_be_explained(const CheckRule& rule) {
  return rule.stored == CheckRule::Stored::kBinary && rule.separator == 0;
}

/// Why the check of one complete frame of a type fails, as the end of a sentence: "; sync and length fit, the check
/// does not: …". Variants are tried only for checks of 16 bits or more, because shorter ones fit by chance. Empty if
/// another rule fails, or the checks fit.
std::string explain_check(const MessageType& kind, Frame frame) {
  constexpr int kByChance = 2;  // bytes of a check that no variant fits by chance
  MessageType unchecked = kind;
  unchecked.checks.clear();
  FrameView view;
  const MatchResult result = match_frame(unchecked, frame, kind.after, view);
  if (result.match != Match::kYes || result.length != frame.size()) return {};
  for (const CheckRule& rule : kind.checks) {
    if (can_be_explained(rule) && !check_holds(rule, frame))
      return "; " + mismatch_text(rule, {frame}, rule.size >= kByChance);
  }
  return {};
}

// Test vectors.

Result<void> run_vector(const FrameDescription& description, const TestVector& vector) {
  const auto inspected = inspect_frame(description, vector.bytes);
  const bool whole = inspected && inspected->length == vector.bytes.size();
  if (vector.kind.empty()) {
    if (!inspected) return {};
    return make_error(vector.where,
                      fmt::format("decodes as message type {}; expected to be rejected", inspected->kind_name));
  }
  if (!whole) {
    const auto kind = std::ranges::find(description.kinds, vector.kind, &MessageType::name);
    return make_error(vector.where,
                      fmt::format("{} of {} bytes are a frame; expected one frame of message type {}{}",
                                  inspected ? inspected->length : 0, vector.bytes.size(), vector.kind,
                                  kind == description.kinds.end() ? "" : explain_check(*kind, vector.bytes)));
  }
  if (inspected->kind_name != vector.kind) {
    return make_error(vector.where,
                      fmt::format("decodes as message type {}; expected {}", inspected->kind_name, vector.kind));
  }
  for (const TestVector::Expectation& expected : vector.expected) {
    const auto value = std::find_if(inspected->values.begin(), inspected->values.end(),
                                    [&](const InspectedFrame::Value& v) { return v.field == expected.field; });
    if (value == inspected->values.end())
      return make_error(vector.where, fmt::format("has no field {}", expected.field));
    const double allowed = vector.tolerance * std::abs(expected.value) + 1e-12;
    if (!(std::abs(value->value - expected.value) <= allowed)) {
      return make_error(vector.where,
                        fmt::format("{} is {:.12g}; expected {:.12g}", expected.field, value->value, expected.value));
    }
  }
  return {};
}

}  // namespace

std::optional<InspectedFrame> inspect_frame(const FrameDescription& description, std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return std::nullopt;
  FrameView view;
  for (std::size_t k = 0; k < description.kinds.size(); ++k) {
    const MessageType& kind = description.kinds[k];
    const MatchResult result = match_frame(kind, bytes, kind.after, view);
    if (result.match != Match::kYes) continue;
    InspectedFrame frame{static_cast<std::int32_t>(k), kind.name, result.length, {}};
    for (std::size_t f = 0; f < kind.fields.size(); ++f) {
      const int field = static_cast<int>(f);
      if (view.present(field)) frame.values.push_back({kind.fields[f].name, kind.fields[f].unit, view.value(field)});
    }
    return frame;
  }
  return std::nullopt;
}

Result<void> run_test_vectors(const FrameDescription& description) {
  for (const TestVector& vector : description.test_vectors) {
    if (Result<void> result = run_vector(description, vector); !result) return result;
  }
  return {};
}

std::string proof_text(const FrameDescription& description) {
  const std::size_t vectors = description.test_vectors.size();
  if (vectors == 0) return fmt::format("frames {}, no test vector: nothing is proved", description.name);
  return fmt::format("frames {}, {} {}", description.name, counted(vectors, "test vector"),
                     vectors == 1 ? "holds" : "hold");
}

std::string explain_checks(const FrameDescription& description, Frame bytes) {
  for (const MessageType& kind : description.kinds) {
    const Candidates found = candidates_of(kind, bytes);
    if (found.count < kLeast) continue;
    for (const CheckRule& rule : kind.checks) {
      if (can_be_explained(rule) && !fits(rule, found.frames))
        return fmt::format("{} candidates of \"{}\": {}", found.count, kind.name,
                           mismatch_text(rule, found.frames, true));
    }
  }
  return {};
}

// Scores descriptions on a stream.

namespace {

constexpr std::uint64_t kLeastFrames = 3;
constexpr double kLeastShare = 0.5;

}  // namespace

Sniffer::Sniffer(const std::vector<FrameDescriptionPtr>& descriptions) {
  for (const FrameDescriptionPtr& description : descriptions) decoders_.emplace_back(description);
  rates_.resize(decoders_.size());
}

void Sniffer::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  if (bytes_ == 0) first_ns_ = arrival_ns;
  last_ns_ = arrival_ns;
  bytes_ += bytes.size();
  for (std::size_t i = 0; i < decoders_.size(); ++i) {
    readings_.clear();
    decoders_[i].feed(bytes, arrival_ns, readings_);
    const bool gyro =
        decoders_[i].description().carries_gyro();  // an instrument without a gyro counts with its sensors
    rates_[i] += static_cast<std::uint64_t>(std::count_if(
        readings_.begin(), readings_.end(), [&](const DecodedMessage& reading) { return reading.has_gyro || !gyro; }));
  }
}

std::vector<SniffScore> Sniffer::ranking() const {
  std::vector<SniffScore> scores;
  for (std::size_t i = 0; i < decoders_.size(); ++i) {
    const FrameDecoder& decoder = decoders_[i];
    const DecoderCounters& counters = decoder.counters();
    SniffScore& score = scores.emplace_back();
    score.description = decoder.description_ptr();
    score.frames = counters.frames;
    score.rates = rates_[i];
    score.bytes = counters.bytes;
    score.single = counters.unconfirmed;
    score.framed_bytes = counters.bytes - counters.skipped_bytes - decoder.held_bytes();
    const double seconds = 1e-9 * static_cast<double>(last_ns_ - first_ns_);
    score.rate_hz = seconds > 0 ? static_cast<double>(counters.frames) / seconds : 0;
    const bool explained = score.rates > 0 && score.share() >= kLeastShare;
    score.fits = explained && score.frames >= kLeastFrames;
    score.too_few = explained && !score.fits;
  }
  const auto rank = [](const SniffScore& s) {
    return std::tuple(s.fits, s.too_few, s.share(), s.frames, s.has_gaps());
  };
  std::stable_sort(scores.begin(), scores.end(),
                   [&](const SniffScore& a, const SniffScore& b) { return rank(a) > rank(b); });
  return scores;
}

std::string single_frames_text(std::uint64_t count) {
  return fmt::format("{} single frames fit, never two in a row; describe the messages between them", count);
}

std::string sniff_line(const SniffScore& score) {
  std::string line = fmt::format("{:<18} {:<5} {} frames, {:.1f} % of {} bytes", score.description->name,
                                 score.fits ? "fits" : "-", score.frames, 100 * score.share(), score.bytes);
  if (score.frames > 0 && score.rate_hz > 0) line += fmt::format(", {:.4g} Hz", score.rate_hz);
  if (score.too_few) line += fmt::format(": too few, at least {} are needed", kLeastFrames);
  if (score.has_gaps()) line += ": " + single_frames_text(score.single);
  if (score.frames > 0 && score.rates == 0) line += ": none with a rate";
  return line;
}

}  // namespace prism::wire
