// SPDX-License-Identifier: MIT
// Compiles the text of a description into its tables.
#include "drivers/wire/description/frame_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/escape.hpp"
#include "base/json_table.hpp"
#include "drivers/wire/description/column_choice.hpp"
#include "drivers/wire/description/readers.hpp"

namespace prism::wire {
namespace {

constexpr std::size_t kMaxKinds = 64;
constexpr Range kRateHz{0.01, 100'000};

WireFormat read_line(const Section& s) {
  WireFormat wire;
  wire.baud = static_cast<int>(s.integer("baud", {50, 20'000'000}));
  wire.data_bits = static_cast<int>(s.integer("data_bits", {7, 8}, wire.data_bits));
  wire.stop_bits = static_cast<int>(s.integer("stop_bits", {1, 2}, wire.stop_bits));
  wire.parity = static_cast<Parity>(s.choice("parity", {"none", "even", "odd"}, 0));
  return wire;
}

TestVector read_vector(const Section& s) {
  TestVector vector;
  vector.where = s.where();
  vector.name = s.text("name", "");
  if (s.has("text")) {
    const std::string text = s.raw_text("text");
    vector.bytes.assign(text.begin(), text.end());
    if (s.has("hex")) s.fail("hex", "given together with \"text\"; expected one of them");
  } else {
    vector.bytes = s.bytes("hex");
  }
  const double tolerance = s.number("tolerance", {0, 1e9}, 1e-6);
  if (s.boolean("refused", false)) {
    s.allow({"kind", "values"});
    if (s.has("kind") || s.has("values"))
      s.fail("refused", "given together with kind or values; a refused frame has neither");
    return vector;
  }
  vector.kind = s.text("kind", {}, TextRule::kMessageName);
  const Section values = s.object("values");
  for (const std::string& field : values.names(TextRule::kMessageName)) {
    vector.expected.push_back({field, values.number(field, kAnyNumber), tolerance});
  }
  return vector;
}

void read_kinds(const Section& s, FrameDescription& description) {
  const bool big_endian = read_byte_order(s, "order", true);
  const FieldGroups groups = read_field_groups(s);
  const std::vector<Section> kinds = s.objects("kinds");
  if (kinds.empty() || kinds.size() > kMaxKinds) {
    return s.fail("kinds",
                  fmt::format("found {}, expected an array of 1 to {} message types", kinds.size(), kMaxKinds));
  }
  for (const Section& kind : kinds) {
    description.kinds.push_back(read_kind(kind, big_endian, groups));
    description.max_frame_bytes = std::max(description.max_frame_bytes, description.kinds.back().length.max);
  }
}

/// Selects the message types that an encoder sends in turn: those in "send", else the first with gyro data (or, without
/// a gyro, with any data).
void read_send(const Section& s, FrameDescription& description) {
  for (const std::string& name : s.texts("send", false)) {
    const auto kind = std::find_if(description.kinds.begin(), description.kinds.end(),
                                   [&](const MessageType& k) { return k.name == name; });
    if (kind == description.kinds.end()) return s.fail("send", fmt::format("unknown message type \"{}\"", name));
    description.sent_kinds.push_back(static_cast<int>(kind - description.kinds.begin()));
  }
  for (std::size_t k = 0; k < description.kinds.size() && description.sent_kinds.empty(); ++k) {
    const MessageFields& roles = description.kinds[k].roles;
    if (description.carries_gyro() ? roles.carries_gyro() : roles.tells_anything())
      description.sent_kinds.push_back(static_cast<int>(k));
  }
}

void read_all(const Section& s, const GyroChoice& choice, FrameDescription& description) {
  s.text("$schema", "");  // for editors
  s.choice("format", {"prism-frames"});
  s.integer("version", {1, 1});
  description.name = s.text("name", {}, TextRule::kName);
  description.title = s.text("title", "");
  description.source = s.text("source", "");
  s.text("proved", "");
  description.wire = read_line(s.object("line", true));
  description.wire.baud = choice.baud.value_or(description.wire.baud);
  description.rate_hz = choice.rate_hz.value_or(s.number("rate_hz", kRateHz));
  description.rate_tolerance = s.number("rate_tolerance", {0, 0.5}, 0.01);
  description.latency_s = 1e-6 * s.number("latency_us", {0, 1e6}, 0);
  read_kinds(s, description);
  if (!s.good()) return;
  read_roles(s, choice, description);
  read_send(s, description);
  command_keys().read(s, description.commands);
  for (const Section& vector : s.objects("vectors", false)) description.test_vectors.push_back(read_vector(vector));
  if (s.good()) check_description(s, description, choice.network);
}

Result<void> check_choice(const std::string& where, const GyroChoice& choice) {
  if (choice.axes.empty() || choice.axes.size() > kMaxAxes)
    return make_error(where, fmt::format("found {} chosen axes, expected 1 to {}", choice.axes.size(), kMaxAxes));
  std::set<std::string> names;
  for (const AxisChoice& axis : choice.axes) {
    if (!names.insert(axis.axis).second)
      return make_error(where, fmt::format("axis \"{}\" is chosen twice", axis.axis));
    if (axis.sign != 1 && axis.sign != -1)
      return make_error(where, fmt::format("found sign {}, expected 1 or -1", axis.sign));
    if (const auto scale = axis.scale_factor_arcsec_per_pulse; scale && !(*scale > 0 && std::isfinite(*scale)))
      return make_error(where, fmt::format("found scale factor {} arcsec/pulse, expected more than 0", *scale));
  }
  if (const auto rate = choice.rate_hz; rate && !(*rate >= kRateHz.min && *rate <= kRateHz.max)) {
    return make_error(where, fmt::format("found a rate of {} Hz, expected {} to {}", *rate, kRateHz.min, kRateHz.max));
  }
  return {};
}

/// Removes from the canonical text everything that does not affect decoding.
void erase_beliefs(Json& description) {
  for (const char* key : {"$schema", "start", "stop", "again_when_silent", "poll"}) description.erase(key);
  if (!description.contains("gyro")) return;  // sensors only
  description["gyro"].erase("range_deg_per_s");
  description.erase("sensors");  // in the form with "axes" only: the decoding of an axis does not depend on them
  for (auto& [name, axis] : description["gyro"]["axes"].items()) {
    if (axis.is_object() && axis.erase("temperature") > 0 && axis.size() == 1) axis = Json(axis.at("field"));
  }
  for (const char* channel : {"temperature", "uhfo"}) {
    const auto found = description.find(channel);
    if (found == description.end()) continue;
    for (const char* key : {"range", "greatest_slope_degc_per_s"}) found->erase(key);
  }
}

/// FNV-1a over the canonical text: short, and the same on every machine. An identifier, not a protection.
std::string id_of(const std::string& canonical) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : canonical) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

}  // namespace

Result<FrameDescriptionPtr> parse_frame_description(std::string_view text, std::string_view where,
                                                    const GyroChoice& choice) {
  Result<JsonDocument> document = parse_json_object(text, where);
  if (!document) return tl::unexpected<Error>(document.error());
  if (const auto fits = check_choice(document->where, choice); !fits) return tl::unexpected<Error>(fits.error());
  if (const auto chosen = choose_columns(document->value, document->where, choice.text); !chosen)
    return tl::unexpected<Error>(chosen.error());
  auto description = std::make_shared<FrameDescription>();
  const Section whole(*document);
  description->warnings = whole.removed(KeyFile::kFrames);
  read_all(whole, choice, *description);
  if (const auto rest = whole.finish(); !rest) return tl::unexpected<Error>(rest.error());
  erase_beliefs(document->value);
  description->id = id_of(json_text(document->value));
  return FrameDescriptionPtr(std::move(description));
}

}  // namespace prism::wire
