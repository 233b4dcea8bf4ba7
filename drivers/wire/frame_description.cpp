// SPDX-License-Identifier: MIT
// From the text of a description to its tables.
#include "drivers/wire/frame_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/wire/description_checks.hpp"
#include "drivers/wire/kind_reader.hpp"
#include "drivers/wire/roles_reader.hpp"

namespace prism::wire {
namespace {

constexpr std::size_t kMaxKinds = 64;
constexpr double kLeastRateHz = 0.01;
constexpr double kMostRateHz = 100'000;

WireFormat read_line(const Section& s) {
  WireFormat wire;
  wire.baud = static_cast<int>(s.whole("baud", 50, 20'000'000));
  wire.data_bits = static_cast<int>(s.whole("data_bits", 7, 8, 8));
  wire.stop_bits = static_cast<int>(s.whole("stop_bits", 1, 2, 1));
  const std::string parity = s.choice("parity", {"none", "even", "odd"});
  wire.parity = parity == "even" ? Parity::kEven : parity == "odd" ? Parity::kOdd : Parity::kNone;
  return wire;
}

TestVector read_vector(const Section& s, const std::string& file) {
  TestVector vector;
  vector.where = file + ":" + s.pointer("");
  vector.name = s.text("name", "");
  if (s.has("text")) {
    const std::string text = s.text("text");
    vector.bytes.assign(text.begin(), text.end());
    if (s.has("hex")) s.refuse("hex", "stands beside \"text\"; expected one of them");
  } else {
    vector.bytes = s.bytes("hex");
  }
  const double tolerance = s.number("tolerance", 0, 1e9, 1e-6);
  if (s.flag("refused", false)) {
    if (s.has("kind") || s.has("values")) s.refuse("refused", "stands beside kind or values; a refused frame has none");
    return vector;
  }
  vector.kind = s.text("kind");
  if (!s.has("values")) return vector;
  const Json& values = s.at("values");
  if (!values.is_object()) s.refuse("values", found(values) + " is not an object of numbers");
  for (const auto& [field, value] : values.items()) {
    if (!value.is_number())
      s.refuse("values/" + field, found(value) + " is not a number");
    else
      vector.expected.push_back({field, value.get<double>(), tolerance});
  }
  return vector;
}

void read_vectors(const Section& s, const std::string& file, FrameDescription& description) {
  if (!s.has("vectors")) return;
  const Json& json = s.at("vectors");
  if (!json.is_array()) return s.refuse("vectors", found(json) + " is not an array");
  for (std::size_t i = 0; i < json.size(); ++i) {
    description.test_vectors.push_back(
        read_vector(Section(s.problems(), json[i], fmt::format("/vectors/{}", i), "vector"), file));
  }
}

void read_kinds(const Section& s, FrameDescription& description) {
  const bool big_endian = s.byte_order("order", true);
  const Parts parts = read_parts(s);
  const Json& kinds = s.at("kinds");
  if (!kinds.is_array() || kinds.empty() || kinds.size() > kMaxKinds) {
    return s.refuse("kinds", fmt::format("{} is not an array of 1 to {} kinds", found(kinds), kMaxKinds));
  }
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    description.kinds.push_back(read_kind(s.problems(), kinds[i], fmt::format("/kinds/{}", i), big_endian, parts));
    description.max_frame_bytes = std::max(description.max_frame_bytes, description.kinds.back().length.max);
  }
}

/// Which kinds an encoder sends, in turn: as "send" says, else the first that carries the gyro.
void read_send(const Section& s, FrameDescription& description) {
  const auto index_of = [&](const std::string& name) {
    const auto it = std::find_if(description.kinds.begin(), description.kinds.end(),
                                 [&](const FrameKind& k) { return k.name == name; });
    return it == description.kinds.end() ? -1 : static_cast<int>(it - description.kinds.begin());
  };
  if (s.has("send")) {
    for (const std::string& name : s.texts("send")) {
      description.sent_kinds.push_back(index_of(name));
      if (description.sent_kinds.back() < 0) s.refuse("send", fmt::format("\"{}\" is no kind", name));
    }
    return;
  }
  for (std::size_t k = 0; k < description.kinds.size() && description.sent_kinds.empty(); ++k) {
    if (!description.kinds[k].roles.gyro.empty()) description.sent_kinds.push_back(static_cast<int>(k));
  }
}

void read_all(const Section& s, const std::string& file, const GyroChoice& choice, FrameDescription& description) {
  s.text("$schema", "");  // for editors
  s.choice("format", {"prism-frames"}, true);
  s.whole("version", 1, 1);
  description.name = s.text("name");
  description.title = s.text("title", "");
  description.source = s.text("source", "");
  s.text("proved", "");
  description.wire = read_line(s.sub("line", "line"));
  description.rate_hz = choice.rate_hz.value_or(s.number("rate_hz", kLeastRateHz, kMostRateHz));
  description.rate_tolerance = s.number("rate_tolerance", 0, 0.5, 0.01);
  description.latency_s = 1e-6 * s.number("latency_us", 0, 1e6, 0);
  read_kinds(s, description);
  if (s.problems().any()) return;
  read_roles(s, choice, description);
  read_send(s, description);
  read_vectors(s, file, description);
}

/// FNV-1a over the canonical text: short, and the same on every machine. It identifies, it does not protect.
std::string id_of(const std::string& canonical) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : canonical) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return fmt::format("{:016x}", hash);
}

}  // namespace

Result<FrameDescriptionPtr> parse_frame_description(std::string_view text, std::string_view where,
                                                    const GyroChoice& choice) {
  const std::string file(where);
  Json json;
  try {
    json = Json::parse(text, nullptr, true, true);
  } catch (const Json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(error.byte, text.size()));
    const auto line = 1 + std::count(text.begin(), end, '\n');
    return refuse(fmt::format("{}:{}", file, line), "is not JSON here; expected a frame description (docs/frames.md)");
  }
  if (choice.sign != 1 && choice.sign != -1)
    return refuse(file, fmt::format("sign {} is neither 1 nor -1", choice.sign));
  if (const auto scale = choice.scale_factor_arcsec_per_pulse; scale && !(*scale > 0 && std::isfinite(*scale))) {
    return refuse(file, fmt::format("scale factor {} arcsec/pulse is not above 0", *scale));
  }
  if (const auto rate = choice.rate_hz; rate && !(*rate >= kLeastRateHz && *rate <= kMostRateHz)) {
    return refuse(file, fmt::format("a rate of {} Hz is not within {} to {}", *rate, kLeastRateHz, kMostRateHz));
  }
  auto description = std::make_shared<FrameDescription>();
  Problems problems(file);
  read_all(Section(problems, json, "", "description"), file, choice, *description);
  if (!problems.any()) check_description(problems, *description);
  if (problems.any()) return tl::unexpected<Error>(*problems.first());
  json.erase("$schema");
  description->id = id_of(json.dump());
  return FrameDescriptionPtr(std::move(description));
}

}  // namespace prism::wire
