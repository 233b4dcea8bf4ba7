// SPDX-License-Identifier: MIT
// Reads "gyro", "counter", "temperature" … and sets the roles of each message type's fields.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

#include "drivers/wire/description/readers.hpp"

namespace prism::wire {
namespace {

constexpr double kArcsecPerDegree = 3600;
constexpr double kArcsecPerRadian = 180 / std::numbers::pi * kArcsecPerDegree;

/// Adds fields of these names to a role in every message type that has them. Errors: a name that no message type has.
void assign(const Section& s, const std::string& key, const std::vector<std::string>& names,
            FrameDescription& description, const std::function<void(MessageFields&, int field)>& give) {
  for (const std::string& name : names) {
    bool known = false;
    for (MessageType& kind : description.kinds) {
      const int field = kind.field_index(name);
      if (field < 0) continue;
      give(kind.roles, field);
      known = true;
    }
    if (!known) s.fail(key, fmt::format("no message type has a field \"{}\"", name));
  }
}

/// Adds the fields listed in `key`.
void assign(const Section& s, const char* key, FrameDescription& description, FieldList MessageFields::*role) {
  assign(s, key, s.texts(key), description, [&](MessageFields& roles, int field) { (roles.*role).push_back(field); });
}

/// The first field with a role in any message type. `role` returns the role's list of a type.
template <class Role>
const Field* first_with(const FrameDescription& description, Role role) {
  for (const MessageType& kind : description.kinds) {
    const FieldList& fields = *role(kind.roles);
    if (!fields.empty()) return &kind.fields[static_cast<std::size_t>(fields.front())];
  }
  return nullptr;
}

bool is_whole(const Field& field) { return field.type == NumberType::kUnsigned || field.type == NumberType::kSigned; }

/// For the served axes from `first` to before `end`.
void read_valid(const Section& s, FrameDescription& description, std::size_t first, std::size_t end) {
  for (const Section& rule : s.one_or_more_objects("valid")) {
    const std::uint64_t mask = rule.bits("mask", ~std::uint64_t{0});
    const std::uint64_t value = rule.bits("value");
    if ((value & ~mask) != 0)
      rule.fail("value",
                fmt::format("found {}, expected bits of the mask {}: (field & mask) is compared", value, mask));
    assign(rule, "field", {rule.text("field")}, description, [&](MessageFields& roles, int field) {
      for (std::size_t i = first; i < end; ++i) roles.axes[i].valid.push_back({field, mask, value});
    });
  }
}

/// Sets an axis's scale: deg/h or arcsec for one unit of its number. For pulses it is the gyro's own scale factor,
/// which the choice may override.
void read_unit(const Section& s, const GyroChoice& choice, FrameDescription& description) {
  struct Unit {
    const char* name;
    double scale;  ///< deg/h or arcsec; 0: pulses
  };
  static constexpr Unit kRates[] = {
      {"deg/h", 1}, {"arcsec/s", 1}, {"deg/s", kArcsecPerDegree}, {"rad/s", kArcsecPerRadian}, {"pulse/s", 0}};
  static constexpr Unit kAngles[] = {{"pulse", 0}, {"arcsec", 1}, {"deg", kArcsecPerDegree}, {"rad", kArcsecPerRadian}};
  const std::span<const Unit> units =
      description.gyro.meaning == RateEncoding::kRate ? std::span<const Unit>(kRates) : kAngles;
  std::vector<const char*> names;
  for (const Unit& unit : units) names.push_back(unit.name);
  const Unit& unit = units[s.choice("unit", names)];
  const bool pulses = unit.scale == 0;
  if (!pulses && s.has("arcsec_per_pulse"))
    s.fail("arcsec_per_pulse", "has no meaning with this unit; expected unit \"pulse\"");
  const double scale = pulses ? s.number("arcsec_per_pulse", {1e-9, 1e6}) : unit.scale;
  for (std::size_t i = 0; i < choice.axes.size(); ++i) {
    const AxisChoice& axis = choice.axes[i];
    if (!pulses && axis.scale_factor_arcsec_per_pulse)
      s.fail("unit", fmt::format("is \"{}\": a scale factor in arcsec/pulse does not apply", unit.name));
    description.axes[i].scale = axis.scale_factor_arcsec_per_pulse.value_or(scale) * axis.sign;
  }
}

/// Sets the sensor that is the axis's own thermometer.
void read_thermometer(const Section& s, const FrameDescription& description, AxisRule& axis) {
  if (!s.has("temperature")) return;
  const std::string name = s.text("temperature");
  for (std::size_t k = 0; k < description.sensors.size(); ++k) {
    if (description.sensors[k].sensor.name == name) axis.thermometer = static_cast<int>(k);
  }
  if (axis.thermometer < 0)
    return s.fail("temperature", fmt::format("found \"{}\", expected one of \"sensors\"", name));
  const std::string& unit = description.sensors[static_cast<std::size_t>(axis.thermometer)].sensor.unit;
  if (unit != "degC") s.fail("temperature", fmt::format("\"{}\" is in {}, expected degC", name, unit));
}

/// Reads one axis served at index `i`: fields, sign and validity; or only the names of its fields.
void read_axis(const Section& axes, const std::string& name, FrameDescription& description, std::size_t i) {
  const auto give = [i](MessageFields& roles, int field) { roles.axes[i].gyro.push_back(field); };
  if (!axes.is_object(name)) return assign(axes, name, axes.texts(name), description, give);
  const Section s = axes.object(name);
  assign(s, "field", s.texts("field"), description, give);
  const double sign = s.number("sign", {-1, 1}, 1);
  if (std::abs(sign) != 1) s.fail("sign", fmt::format("found {}, expected 1 or -1", sign));
  description.axes[i].scale *= sign;
  read_thermometer(s, description, description.axes[i]);
  read_valid(s, description, i, i + 1);
}

/// Adds the chosen axes to the description. Reads the others, too, so that an error in
/// them is found at once.
void read_axes(const Section& gyro, const GyroChoice& choice, FrameDescription& description) {
  const Section axes = gyro.object("axes", true);
  const std::vector<std::string>& names = description.axis_names = axes.names(TextRule::kAxisName);
  if (!gyro.good()) return;
  if (names.empty()) return gyro.fail("axes", "found none, expected at least one axis");
  for (std::size_t i = 0; i < choice.axes.size(); ++i) {
    std::string& chosen = description.axes[i].name;
    chosen = choice.axes[i].axis.empty() ? names.front() : choice.axes[i].axis;
    if (!axes.has(chosen))
      return gyro.fail("axes", fmt::format("unknown axis \"{}\"; expected one of {}", chosen, fmt::join(names, ", ")));
  }
  for (const std::string& name : names) {
    const auto served = std::find_if(description.axes.begin(), description.axes.end(),
                                     [&](const AxisRule& axis) { return axis.name == name; });
    FrameDescription scratch = description;
    if (served == description.axes.end()) {
      read_axis(axes, name, scratch, 0);
    } else {
      read_axis(axes, name, description, static_cast<std::size_t>(served - description.axes.begin()));
    }
  }
}

/// Modulus of an accumulated angle of each axis: "wrap", or the range of its integer field.
void read_wrap(const Section& s, FrameDescription& description) {
  if (description.gyro.meaning != RateEncoding::kAccumulated) {
    if (s.has("wrap")) s.fail("wrap", "only valid for an accumulated angle");
    return;
  }
  for (std::size_t i = 0; i < description.axes.size(); ++i) {
    const Field* field = first_with(description, [i](const MessageFields& roles) { return &roles.axes[i].gyro; });
    if (field == nullptr) continue;
    const double own = is_whole(*field) ? std::ldexp(std::abs(field->scaling.scale), field->bits) : 0;
    description.axes[i].wrap = s.number("wrap", {0, 1e18}, own);
  }
}

/// The bits of a field that the device leaves unused, and that an output sets in corrected frames.
void read_corrected(const Section& s, FrameDescription& description) {
  const std::uint64_t mask = s.bits("mask");
  if (mask == 0) s.fail("mask", "found 0, expected the bits of a corrected frame");
  assign(s, "field", {s.text("field")}, description, [&](MessageFields& roles, int field) {
    roles.corrected.push_back({field, mask, mask});
  });
  for (const MessageType& kind : description.kinds) {
    for (const ValidRule& rule : kind.roles.corrected) {
      const Field& field = kind.fields[static_cast<std::size_t>(rule.field)];
      if (kind.structure == Structure::kColumns || !is_whole(field))
        s.fail("field", fmt::format("\"{}\" is not an integer of a binary frame, which has bits", field.name));
      for (const AxisRoles& axis : kind.roles.axes) {
        for (const ValidRule& valid : axis.valid) {
          if (valid.field == rule.field && (valid.mask & mask) != 0)
            s.fail("mask", fmt::format("has bits of \"valid\", which the device sets in \"{}\"", field.name));
        }
      }
    }
  }
}

void read_gyro(const Section& s, const GyroChoice& choice, FrameDescription& description) {
  GyroRule& rule = description.gyro;
  rule.meaning =
      static_cast<RateEncoding>(s.explained_choice("meaning", {{"rate", "angular rate"},
                                                               {"increment", "angle since the last frame"},
                                                               {"accumulated", "running total of the angle"}}));
  description.axes.resize(choice.axes.size());
  for (MessageType& kind : description.kinds) kind.roles.axes.resize(choice.axes.size());
  read_unit(s, choice, description);
  rule.interval_s = s.number("interval_s", {1e-6, 1e4}, rule.interval_s);
  if (rule.interval_s != 0 && rule.meaning != RateEncoding::kIncrement)
    s.fail("interval_s", "only valid for an increment");
  description.plausible.rate.range = read_range(s, "range_deg_per_s", kRateRanges, kDegPerSInDegPerH);
  read_valid(s, description, 0, description.axes.size());
  read_axes(s, choice, description);
  if (s.has("corrected")) read_corrected(s.object("corrected"), description);
  read_wrap(s, description);
}

/// A counter counts: seconds with a fraction would be read as whole ticks.
void check_counter_field(const Section& s, const Field& field) {
  const bool real = field.type == NumberType::kFloat32 || field.type == NumberType::kFloat64;
  if (real || field.decimals > 0)
    s.fail("field", fmt::format("the field \"{}\" is {}, expected an integer of frames or ticks", field.name,
                                real ? "a floating-point number" : "a number with decimals"));
}

/// Where a counter that uses the whole field starts again; 0: at 2^64, or not known.
std::uint64_t natural_modulus(const Field& field) {
  if (field.type != NumberType::kDigits) return field.bits >= 64 ? 0 : std::uint64_t{1} << field.bits;
  std::uint64_t modulus = 1;
  for (unsigned i = 0; i < field.size; ++i) modulus *= 10;
  return modulus;
}

void read_counter(const Section& s, FrameDescription& description) {
  CounterRule rule;
  assign(s, "field", description, &MessageFields::counter);
  for (const MessageType& kind : description.kinds) {
    for (const int at : kind.roles.counter) check_counter_field(s, kind.fields[static_cast<std::size_t>(at)]);
  }
  const Field* field = first_with(description, [](const MessageFields& roles) { return &roles.counter; });
  const std::uint64_t own = field == nullptr ? 0 : natural_modulus(*field);
  rule.modulus = s.bits("modulus", own);
  if (own != 0 && rule.modulus > own)
    s.fail("modulus", fmt::format("{} is more than the field's {}", rule.modulus, own));
  rule.step_varies = s.boolean("step_varies", rule.step_varies);
  rule.ticks_per_s = s.number("ticks_per_s", {1e-3, 1e10}, 0);
  rule.step_follows_rate = rule.ticks_per_s > 0 && !s.has("step");
  const double step = rule.ticks_per_s > 0 ? rule.ticks_per_s / description.rate_hz : 1;
  rule.ticks_per_frame = s.number("step", {1e-3, 1e10}, step);
  if (rule.ticks_per_s == 0) rule.ticks_per_s = rule.ticks_per_frame * description.rate_hz;
  if (rule.modulus != 0 && rule.ticks_per_frame >= static_cast<double>(rule.modulus)) {
    s.fail("modulus", fmt::format("{} is not above the step of {} ticks a frame", rule.modulus, rule.ticks_per_frame));
  }
  description.counter = rule;
}

/// `fields` returns the roles of the channel in a message type.
void read_channel(const Section& s, FrameDescription& description, SlowChannel& slow,
                  const std::function<ChannelFields&(MessageFields&)>& fields) {
  slow.present = true;
  slow.stale_after_s = s.number("stale_after_s", {0, 3600}, slow.stale_after_s);
  if (s.has("field")) {
    for (const char* key : {"high", "low", "low_bits", "bits", "signed", "scale", "offset", "min", "max", "convert"}) {
      if (s.has(key)) s.fail(key, "only valid for halves (\"high\", \"low\"); with \"field\" set it in the field");
    }
    return assign(s, "field", s.texts("field"), description,
                  [&](MessageFields& roles, int field) { fields(roles).whole.push_back(field); });
  }
  const auto assign_half = [&](const char* key, int ChannelFields::*half) {
    assign(s, key, {s.text(key)}, description, [&](MessageFields& roles, int field) { fields(roles).*half = field; });
  };
  assign_half("high", &ChannelFields::high);
  assign_half("low", &ChannelFields::low);
  slow.low_bits = static_cast<int>(s.integer("low_bits", {1, 32}, slow.low_bits));
  slow.bits = static_cast<int>(s.integer("bits", {2, 64}, slow.bits));
  slow.is_signed = s.boolean("signed", slow.is_signed);
  slow.joined = read_scaling(s);
}

/// Call before the axes are read: they refer to thermometers among the sensors.
void read_sensors(const Section& s, FrameDescription& description) {
  const std::vector<std::string> names = s.names(TextRule::kSensorName);
  if (names.size() > kMaxSensors)
    return s.fail("", fmt::format("found {} sensors, expected at most {}", names.size(), kMaxSensors));
  for (MessageType& kind : description.kinds) kind.roles.sensors.resize(names.size());
  description.sensors.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Section own = s.object(names[i]);
    if (!is_sensor_name(names[i]) || names[i].find('.') != std::string::npos)
      s.fail(names[i], "invalid sensor name, expected letters, digits and _, not T, U, dTdt or lagN");
    SensorRule& rule = description.sensors[i];
    rule.sensor = {names[i], kSensorUnitNames[own.choice("unit", kSensorUnitNames)]};
    read_channel(own, description, rule.channel,
                 [i](MessageFields& roles) -> ChannelFields& { return roles.sensors[i]; });
    const Field* field = first_with(description, [i](const MessageFields& roles) { return &roles.sensors[i].whole; });
    if (field && !field->unit.empty() && field->unit != rule.sensor.unit)
      own.fail("unit",
               fmt::format("found {}, but the field \"{}\" is in {}", rule.sensor.unit, field->name, field->unit));
  }
}

void leave_sensors_out(FrameDescription& description) {
  description.sensors.clear();
  for (MessageType& kind : description.kinds) kind.roles.sensors.clear();
  for (AxisRule& axis : description.axes) axis.thermometer = -1;
}

/// An instrument without a gyro has only sensors.
void refuse_of_gyro(const Section& s) {
  for (const char* key : {"temperature", "uhfo", "latency", "status"}) {
    if (s.has(key)) s.fail(key, "only valid with \"gyro\"; use \"sensors\" instead");
  }
}

/// A stated unit of the channel's field must be `unit`. `remedy`: how to convert the unit `usual`.
void check_unit(const Section& s, const Field* field, const std::string& unit, const std::string& usual,
                const std::string& remedy) {
  if (field == nullptr || field->unit.empty() || field->unit == unit) return;
  s.fail("field", fmt::format("the field \"{}\" is in {}, expected {}{}", field->name, field->unit, unit,
                              field->unit == usual ? remedy : ""));
}

/// Reads the plausibility limits of a channel.
SensorStatement read_statement(const Section& s) {
  return {read_range(s, "range", kChannelRanges), read_greatest_slope(s, "greatest_slope_degc_per_s"), {}};
}

}  // namespace

void read_roles(const Section& s, const GyroChoice& choice, FrameDescription& description) {
  read_sensors(s.object("sensors"), description);
  if (s.has("gyro") || !s.has("sensors"))
    read_gyro(s.object("gyro", true), choice, description);
  else
    refuse_of_gyro(s);
  if (s.has("counter")) read_counter(s.object("counter"), description);
  if (s.has("temperature")) {
    read_channel(s.object("temperature"), description, description.temperature,
                 [](MessageFields& roles) -> ChannelFields& { return roles.temperature; });
    check_unit(s.object("temperature"),
               first_with(description, [](const MessageFields& roles) { return &roles.temperature.whole; }), "degC",
               "K", "; add \"offset\": -273.15 to the field, and make its \"unit\" degC");
    description.plausible.temperature = read_statement(s.object("temperature"));
  }
  if (s.has("uhfo")) {
    read_channel(s.object("uhfo"), description, description.uhfo,
                 [](MessageFields& roles) -> ChannelFields& { return roles.uhfo; });
    check_unit(s.object("uhfo"), first_with(description, [](const MessageFields& roles) { return &roles.uhfo.whole; }),
               "V", "mV", "; divide the field's \"scale\" by 1000, and make its \"unit\" V");
    description.plausible.uhfo = read_statement(s.object("uhfo"));
    if (description.plausible.uhfo.greatest_slope_per_s)
      s.object("uhfo").fail("greatest_slope_degc_per_s", "only valid for the temperature");
  }
  if (!choice.sensors && description.carries_gyro()) leave_sensors_out(description);
  if (s.has("status")) assign(s.object("status"), "field", description, &MessageFields::status);
  if (s.has("latency")) assign(s.object("latency"), "field", description, &MessageFields::latency);
}

}  // namespace prism::wire
