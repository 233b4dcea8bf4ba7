// SPDX-License-Identifier: MIT
// From the JSON of "gyro", "counter", "temperature" … to the roles of each kind's fields.
#include "drivers/wire/roles_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/wire/field_reader.hpp"
#include "drivers/wire/kind_reader.hpp"

namespace prism::wire {
namespace {

constexpr double kArcsecPerDegree = 3600;
constexpr double kArcsecPerRadian = 180 / std::numbers::pi * kArcsecPerDegree;

/// Adds the named fields to a role of every kind that has them; refuses a name that no kind has.
void assign(const Section& s, const char* key, FrameDescription& description, FieldList KindRoles::*role) {
  for (const std::string& name : s.texts(key)) {
    bool known = false;
    for (FrameKind& kind : description.kinds) {
      const int index = field_index(kind, name);
      if (index < 0) continue;
      (kind.roles.*role).push_back(index);
      known = true;
    }
    if (!known) s.refuse(key, fmt::format("\"{}\" is a field of no kind", name));
  }
}

/// The first field that has a role, in whatever kind.
const Field* first_with(const FrameDescription& description, FieldList KindRoles::*role) {
  for (const FrameKind& kind : description.kinds) {
    if (!(kind.roles.*role).empty()) return &kind.fields[static_cast<std::size_t>((kind.roles.*role).front())];
  }
  return nullptr;
}

bool is_whole(const Field& field) { return field.type == NumberType::kUnsigned || field.type == NumberType::kSigned; }

void read_valid(const Section& s, FrameDescription& description) {
  const std::string name = s.text("field");
  const std::uint64_t mask = s.bits("mask", ~std::uint64_t{0});
  const std::uint64_t value = s.bits("value");
  bool known = false;
  for (FrameKind& kind : description.kinds) {
    const int index = field_index(kind, name);
    if (index < 0) continue;
    kind.roles.valid.push_back({index, mask, value});
    known = true;
  }
  if (!known) s.refuse("field", fmt::format("\"{}\" is a field of no kind", name));
}

void read_valids(const Section& s, FrameDescription& description) {
  if (!s.has("valid")) return;
  const Json& json = s.at("valid");
  if (!json.is_array()) return read_valid(s.sub("valid", "valid"), description);
  for (std::size_t i = 0; i < json.size(); ++i) {
    read_valid(Section(s.problems(), json[i], s.pointer(fmt::format("valid/{}", i)), "valid"), description);
  }
}

/// deg/h or arcsec for one unit of the gyro's number. Pulses have the gyro's own scale factor, which the choice may
/// give.
double read_unit(const Section& s, GyroMeaning meaning, const GyroChoice& choice) {
  const bool rate = meaning == GyroMeaning::kRate;
  const std::string unit = rate ? s.choice("unit", {"deg/h", "arcsec/s", "deg/s", "rad/s", "pulse/s"}, true)
                                : s.choice("unit", {"pulse", "arcsec", "deg", "rad"}, true);
  if (unit.starts_with("pulse")) {
    const double scale = s.number("arcsec_per_pulse", 1e-9, 1e6);
    return choice.scale_factor_arcsec_per_pulse.value_or(scale);
  }
  if (s.has("arcsec_per_pulse")) s.refuse("arcsec_per_pulse", "has no meaning with this unit; expected unit \"pulse\"");
  if (choice.scale_factor_arcsec_per_pulse) {
    s.refuse("unit", fmt::format("is \"{}\": a scale factor in arcsec/pulse has no use here", unit));
  }
  return unit.starts_with("deg/s") || unit == "deg" ? kArcsecPerDegree : unit.starts_with("rad") ? kArcsecPerRadian : 1;
}

/// One axis: its fields, its sign and its validity. `json` is the name of a field, several, or an object.
void read_axis(const Section& gyro, const std::string& name, const Json& json, FrameDescription& description) {
  const Json wrapped = json.is_object() ? Json() : Json{{"field", json}};
  const Section s(gyro.problems(), json.is_object() ? json : wrapped, gyro.pointer("axes/" + name), "axis");
  assign(s, "field", description, &KindRoles::gyro);
  const double sign = s.number("sign", -1, 1, 1);
  if (std::abs(sign) != 1) s.refuse("sign", fmt::format("{} is neither 1 nor -1", sign));
  description.gyro.scale *= sign;
  read_valids(s, description);
}

/// The chosen axis goes into the description; the others are read all the same, so that a slip in them is not first
/// found by whoever chooses them.
void read_axes(const Section& gyro, const GyroChoice& choice, FrameDescription& description) {
  const Json& axes = gyro.at("axes");
  if (!axes.is_object() || axes.empty())
    return gyro.refuse("axes", found(axes) + " is not an object of at least one axis");
  for (const auto& [name, json] : axes.items()) description.axes.push_back(name);
  std::string& chosen = description.gyro.axis;
  chosen = choice.axis.empty() ? description.axes.front() : choice.axis;
  if (!axes.contains(chosen)) {
    return gyro.refuse(
        "axes", fmt::format("has no axis \"{}\"; expected one of {}", chosen, fmt::join(description.axes, ", ")));
  }
  for (const auto& [name, json] : axes.items()) {
    if (name == chosen) continue;
    FrameDescription scratch = description;
    read_axis(gyro, name, json, scratch);
  }
  read_axis(gyro, chosen, axes[chosen], description);
}

void read_gyro(const Section& s, const GyroChoice& choice, FrameDescription& description) {
  GyroRule& rule = description.gyro;
  const std::string meaning = s.choice("meaning", {"rate", "increment", "accumulated"}, true);
  rule.meaning = meaning == "rate"        ? GyroMeaning::kRate
                 : meaning == "increment" ? GyroMeaning::kIncrement
                                          : GyroMeaning::kAccumulated;
  rule.scale = read_unit(s, rule.meaning, choice) * choice.sign;
  rule.interval_s = s.number("interval_s", 1e-6, 1e4, 0);
  if (rule.interval_s != 0 && rule.meaning != GyroMeaning::kIncrement)
    s.refuse("interval_s", "belongs to an increment only");
  read_valids(s, description);
  read_axes(s, choice, description);
  const Field* field = first_with(description, &KindRoles::gyro);
  if (rule.meaning != GyroMeaning::kAccumulated) {
    if (s.has("wrap")) s.refuse("wrap", "belongs to an accumulated angle only");
  } else if (field != nullptr) {
    const double own = is_whole(*field) ? std::ldexp(std::abs(field->scaling.scale), field->bits) : 0;
    rule.wrap = s.number("wrap", 0, 1e18, own);
  }
}

void read_counter(const Section& s, FrameDescription& description) {
  CounterRule rule;
  assign(s, "field", description, &KindRoles::counter);
  const Field* field = first_with(description, &KindRoles::counter);
  const std::uint64_t own = field == nullptr || field->bits >= 64 ? 0 : std::uint64_t{1} << field->bits;
  rule.modulus = s.bits("modulus", own);
  if (own != 0 && rule.modulus > own)
    s.refuse("modulus", fmt::format("{} is more than the field's {}", rule.modulus, own));
  rule.step_varies = s.flag("step_varies", false);
  rule.ticks_per_s = s.number("ticks_per_s", 1e-3, 1e10, 0);
  const double step = rule.ticks_per_s > 0 ? rule.ticks_per_s / description.rate_hz : 1;
  rule.ticks_per_frame = s.number("step", 1e-3, 1e10, step);
  if (rule.ticks_per_s == 0) rule.ticks_per_s = rule.ticks_per_frame * description.rate_hz;
  if (rule.modulus != 0 && rule.ticks_per_frame >= static_cast<double>(rule.modulus)) {
    s.refuse("modulus",
             fmt::format("{} is not above the step of {} ticks a frame", rule.modulus, rule.ticks_per_frame));
  }
  description.counter = rule;
}

void assign_half(const Section& s, const char* key, FrameDescription& description, int KindRoles::*role) {
  const std::string name = s.text(key);
  bool known = false;
  for (FrameKind& kind : description.kinds) {
    const int index = field_index(kind, name);
    if (index < 0) continue;
    kind.roles.*role = index;
    known = true;
  }
  if (!known) s.refuse(key, fmt::format("\"{}\" is a field of no kind", name));
}

void read_channel(const Section& s, FrameDescription& description, SlowChannel FrameDescription::*channel,
                  FieldList KindRoles::*whole, int KindRoles::*high, int KindRoles::*low) {
  SlowChannel& slow = description.*channel;
  slow.present = true;
  slow.stale_after_s = s.number("stale_after_s", 0, 3600, 1);
  if (s.has("field")) {
    for (const char* key : {"high", "low", "low_bits", "bits", "signed", "scale", "offset", "min", "max", "convert"}) {
      if (s.has(key)) s.refuse(key, "belongs to halves (\"high\", \"low\"); with \"field\" the field itself says it");
    }
    return assign(s, "field", description, whole);
  }
  assign_half(s, "high", description, high);
  assign_half(s, "low", description, low);
  slow.low_bits = static_cast<int>(s.whole("low_bits", 1, 32, 8));
  slow.bits = static_cast<int>(s.whole("bits", 2, 64, 16));
  slow.is_signed = s.flag("signed", false);
  slow.joined = read_scaling(s);
}

}  // namespace

void read_roles(const Section& s, const GyroChoice& choice, FrameDescription& description) {
  read_gyro(s.sub("gyro", "gyro"), choice, description);
  if (s.has("counter")) read_counter(s.sub("counter", "counter"), description);
  if (s.has("temperature")) {
    read_channel(s.sub("temperature", "channel"), description, &FrameDescription::temperature, &KindRoles::temperature,
                 &KindRoles::temperature_high, &KindRoles::temperature_low);
  }
  if (s.has("uhfo")) {
    read_channel(s.sub("uhfo", "channel"), description, &FrameDescription::uhfo, &KindRoles::uhfo,
                 &KindRoles::uhfo_high, &KindRoles::uhfo_low);
  }
  if (s.has("status")) assign(s.sub("status", "role"), "field", description, &KindRoles::status);
  if (s.has("latency")) assign(s.sub("latency", "role"), "field", description, &KindRoles::latency);
}

}  // namespace prism::wire
