// SPDX-License-Identifier: MIT
// Compiles the text of a description into its tables.
#include "drivers/wire/description/frame_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/escape.hpp"
#include "drivers/wire/description/keys.hpp"

namespace prism::wire {
namespace {

constexpr std::size_t kMaxKinds = 64;
constexpr Range kRateHz{0.01, 100'000};

JsonTable<WireFormat> line_keys() {
  using W = WireFormat;
  return JsonTable<W>()
      .integer("baud", {50, 20'000'000}, &W::baud, kRequired)
      .integer("data_bits", {7, 8}, &W::data_bits, "")
      .integer("stop_bits", {1, 2}, &W::stop_bits, "")
      .choice("parity", kParities, &W::parity, "");
}

struct VectorDraft {
  TestVector vector;
  std::string text;
  bool refused = false;
};

JsonTable<VectorDraft> vector_keys() {
  using V = VectorDraft;
  const Json values = {{"type", "object"}, {"additionalProperties", {{"type", "number"}}}};
  return JsonTable<V>()
      .group(JsonTable<TestVector>()
                 .text("name", &TestVector::name, "")
                 .bytes("hex", &TestVector::bytes, "the frame")
                 .text("kind", &TestVector::kind, "", TextRule::kMessageName)
                 .number("tolerance", {0, 1e9}, &TestVector::tolerance, "relative"),
             &V::vector)
      .raw_text("text", &V::text, "a text frame, with its terminator")
      .boolean("refused", &V::refused, "the frame must be rejected")
      .known("values", values, "");
}

void add_vector(const Section& s, const std::string&, VectorDraft& draft, FrameDraft& frames) {
  TestVector& vector = draft.vector;
  vector.where = s.where();
  if (s.has("text") && s.has("hex")) s.fail("hex", "given together with \"text\"; expected one of them");
  if (s.has("text")) vector.bytes.assign(draft.text.begin(), draft.text.end());
  if (!s.has("text")) s.require("hex");
  if (draft.refused && (s.has("kind") || s.has("values")))
    s.fail("refused", "given together with kind or values; a refused frame has neither");
  if (!draft.refused) s.require("kind");
  const Section values = s.object("values");
  for (const std::string& field : values.names(TextRule::kMessageName))
    vector.expected.push_back({field, values.number(field, kAnyNumber)});
  frames.description.test_vectors.push_back(std::move(vector));
}

void add_kind(const Section&, const std::string&, MessageType& kind, FrameDraft& frames) {
  FrameDescription& description = frames.description;
  description.max_frame_bytes = std::max(description.max_frame_bytes, kind.length.max);
  description.kinds.push_back(std::move(kind));
}

/// Selects the message types that an encoder sends in turn: those in "send", else the first with gyro data (or, without
/// a gyro, with any data).
void read_send(const Section& s, FrameDraft& frames) {
  FrameDescription& description = frames.description;
  for (const std::string& name : frames.send) {
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

// In the order of reading: roles are read after the message types.
const JsonTable<FrameDraft>& frame_keys() {
  using F = FrameDraft;
  using D = FrameDescription;
  using Form = JsonTable<F>::Form;
  static constexpr std::array kFormats = {"prism-frames"};
  static constexpr std::array kByteOrders = {"big", "little"};
  const auto description = [](auto& draft) -> auto& { return draft.description; };
  static const JsonTable<F> keys =
      JsonTable<F>()
          .known("$schema", {{"type", "string"}}, "for editors")
          .known("format", {{"const", kFormats.front()}}, kRequiredByCheck)
          .known("version", {{"const", 1}}, kRequiredByCheck)
          .then([](const Section& s, F&) {
            s.text("$schema", "");
            s.choice("format", kFormats);
            s.integer("version", {1, 1});
          })
          .group(JsonTable<D>()
                     .text("name", &D::name, {kRequired, "one word; also the name of the file"}, TextRule::kName)
                     .text("title", &D::title, "")
                     .text("source", &D::source, "source of the format")
                     .custom(
                         "proved", {{"type", "string"}}, "how it was verified, or that it is not verified",
                         [](const Section& s, D&) { s.text("proved", ""); }, nullptr)
                     .object("line", line_keys(), &D::wire, {kRequired, "speed and character format of the line"})
                     .number("rate_hz", kRateHz, &D::rate_hz,
                             {kRequired, "nominal frames a second, of those that carry the gyro"})
                     .number("rate_tolerance", {0, 0.5}, &D::rate_tolerance,
                             "relative tolerance of rate_hz between devices")
                     .number("latency_us", {0, 1e6}, &D::latency_s,
                             "delay from the end of the measured interval to the first bit", 1e-6),
                 description)
          .then([](const Section&, F& draft) {
            draft.description.wire.baud = draft.choice.baud.value_or(draft.description.wire.baud);
            draft.description.rate_hz = draft.choice.rate_hz.value_or(draft.description.rate_hz);
          })
          .custom(
              "order", {{"type", "string"}, {"enum", kByteOrders}},
              "default byte order; fields, lengths and checks can have their own",
              [](const Section& s, F&) { s.choice("order", kByteOrders, 0); }, nullptr)
          .objects(
              Form::kNamed, "parts", part_keys(), [](const Section&, const std::string&, int, F&) {},
              "groups of fields shared by several message types")
          .objects(Form::kList, "kinds", message_keys(), add_kind,
                   {kRequired, "message types, tried in this order at each byte"})
          .also({{"minItems", 1}, {"maxItems", kMaxKinds}})
          .then([](const Section& s, F& draft) {
            const std::size_t count = draft.description.kinds.size();
            if (count == 0 || count > kMaxKinds)
              s.fail("kinds", fmt::format("found {}, expected an array of 1 to {} message types", count, kMaxKinds));
          })
          .group(role_keys())
          .texts("send", &F::send,
                 "message types that an encoder sends, in turn; default: the first with the gyro's data")
          .then(read_send)
          .group(
              command_keys(), [](auto& draft) -> auto& { return draft.description.commands; })
          .objects(Form::kList, "vectors", vector_keys(), add_vector, "frames and their values");
  return keys;
}

Result<void> check_choice(const std::string& where, const GyroChoice& choice) {
  if (choice.axes.empty() || choice.axes.size() > kMaxAxes)
    return make_error(where, fmt::format("found {} chosen axes, expected 1 to {}", choice.axes.size(), kMaxAxes));
  std::set<std::string> names;
  for (const AxisChoice& axis : choice.axes) {
    if (!names.insert(axis.axis).second)
      return make_error(where, fmt::format("axis \"{}\" is chosen twice", axis.axis));
  }
  return {};
}

bool is_text_line(const Json& description) {
  if (!description.is_object() || description.contains("gyro") || !description.contains("kinds")) return false;
  const Json& kinds = description["kinds"];
  return kinds.is_array() && kinds.size() == 1 && kinds[0].is_object() && kinds[0].contains("text") &&
         kinds[0]["text"].is_object() && kinds[0].contains("length") && kinds[0]["length"].is_object();
}

/// Template of an encoder: the chosen columns, and a 0 in those between them.
std::string printed(const TextColumns& choice) {
  int last = 0;
  for (const TextColumn& column : choice.columns) last = std::max(last, column.column);
  std::string text;
  for (int i = 0; i <= last; ++i) {
    const auto named = std::find_if(choice.columns.begin(), choice.columns.end(),
                                    [i](const TextColumn& column) { return column.column == i; });
    if (i > 0) text += choice.separators.front();
    text += named == choice.columns.end() ? "0" : "{" + named->sensor.name + ":.4f}";
  }
  return text;
}

// Writes the chosen columns into a description's JSON, as if they were part of it. Without a choice it has no effect.
// Errors: the description does not have exactly one message type of text lines, or has a gyro.
Result<void> choose_columns(JsonDocument& document, const TextColumns& choice) {
  if (choice.columns.empty()) return {};
  Json& description = document.value;
  if (!is_text_line(description))
    return make_error(document.where, "does not describe text lines without a gyro, as required by \"columns\"");
  document.key_lines.clear();  // keys are added
  Json& kind = description["kinds"][0];
  const char* end = choice.ends_with_cr ? "0D" : "0A";
  kind["after"] = end;
  kind["length"]["terminator"] = end;
  // The CR of a CR LF ends the last column.
  const bool blanks = choice.separators.find_first_not_of(" \t") == std::string::npos;
  kind["text"]["separators"] = choice.separators + (choice.ends_with_cr ? "\n" : "\r");
  kind["text"]["collapse"] = blanks;
  kind["text"]["decimal_comma"] = choice.decimal_comma;
  kind["text"]["write"] = printed(choice);
  kind["fields"] = Json::object();
  description["sensors"] = Json::object();
  for (const TextColumn& column : choice.columns) {
    const std::string& name = column.sensor.name;
    Json& field = kind["fields"][name];
    field = {{"column", column.column}, {"type", "decimal"}, {"unit", column.sensor.unit}};
    if (column.min > -1e300) field["min"] = column.min;
    if (column.max < 1e300) field["max"] = column.max;
    description["sensors"][name] = {{"field", name}, {"unit", column.sensor.unit}};
  }
  description["vectors"] = Json::array();  // they belong to other columns
  return {};
}

/// Removes from the canonical text everything that does not affect decoding.
void erase_beliefs(Json& description) {
  for (const char* key : {"$schema", "start", "stop", "again_when_silent", "poll"}) description.erase(key);
  if (!description.contains("gyro")) return;  // sensors only
  description["gyro"].erase("range_deg_per_s");
  description["gyro"].erase("corrected");
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
  if (const auto chosen = choose_columns(*document, choice.text); !chosen) return tl::unexpected<Error>(chosen.error());
  FrameDraft draft;
  draft.choice = choice;
  const Section whole(*document);
  draft.description.warnings = whole.removed(KeyFile::kFrames);
  frame_keys().read(whole, draft);
  if (whole.good()) check_description(whole, draft.description, choice.network);
  if (const auto rest = whole.finish(); !rest) return tl::unexpected<Error>(rest.error());
  erase_beliefs(document->value);
  draft.description.id = id_of(json_text(document->value));
  return std::make_shared<const FrameDescription>(std::move(draft.description));
}

Json frame_schema() {
  Json schema = schema_of_file("prism", "drivers/wire/description", frame_keys().schema());
  schema["title"] = "prism frame description";
  schema["anyOf"] = {{{"required", {"gyro"}}}, {{"required", {"sensors"}}}};
  return schema;
}

}  // namespace prism::wire
