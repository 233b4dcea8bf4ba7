// SPDX-License-Identifier: MIT
#include "drivers/wire/decode/check_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::wire {
namespace {

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

}  // namespace

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

}  // namespace prism::wire
