// SPDX-License-Identifier: MIT
// Names the values of a frame, and runs a description's test vectors.
#include "drivers/wire/decode/inspect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/plain_text.hpp"
#include "drivers/wire/decode/check_search.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::wire {
namespace {

/// Why the check of a vector fails, and the keys with which it fits; empty if another rule fails.
std::string check_hint(const FrameDescription& description, const TestVector& vector) {
  const auto kind = std::find_if(description.kinds.begin(), description.kinds.end(),
                                 [&](const MessageType& k) { return k.name == vector.kind; });
  FrameView view;
  if (kind == description.kinds.end() || match_frame(*kind, vector.bytes, kind->after, view).match != Match::kBadCheck)
    return {};
  for (std::size_t i = 0; i < kind->checks.size(); ++i) {
    MessageType other = *kind;
    CheckRule& check = other.checks[i];
    check.big_endian = !check.big_endian;
    if (match_frame(other, vector.bytes, other.after, view).match == Match::kYes)
      return fmt::format("; the check fails in this byte order, but fits with \"order\": \"{}\"",
                         check.big_endian ? "big" : "little");
  }
  return explain_check(*kind, vector.bytes);
}

Result<void> run_vector(const FrameDescription& description, const TestVector& vector) {
  const auto inspected = inspect_frame(description, vector.bytes);
  const bool whole = inspected && inspected->length == vector.bytes.size();
  if (vector.kind.empty()) {
    if (!inspected) return {};
    return make_error(vector.where,
                      fmt::format("decodes as message type {}; expected to be rejected", inspected->kind_name));
  }
  if (!whole) {
    return make_error(vector.where, fmt::format("{} of {} bytes are a frame; expected one frame of message type {}{}",
                                                inspected ? inspected->length : 0, vector.bytes.size(), vector.kind,
                                                check_hint(description, vector)));
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
    const double allowed = expected.tolerance * std::abs(expected.value) + 1e-12;
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

}  // namespace prism::wire
