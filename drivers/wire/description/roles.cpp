// SPDX-License-Identifier: MIT
// The keys "gyro", "counter", "temperature" …: they set the roles of each message type's fields.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <span>

#include "drivers/wire/description/keys.hpp"

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

/// A field, or several, of which the first in a frame is used.
JsonTable<std::vector<std::string>> fields_keys() {
  return JsonTable<std::vector<std::string>>().texts("field", std::identity(), kRequired);
}

void assign(const Section& s, const std::vector<std::string>& names, FrameDescription& description,
            FieldList MessageFields::*role) {
  assign(s, "field", names, description, [&](MessageFields& roles, int field) { (roles.*role).push_back(field); });
}

// The gyro.

struct Unit {
  const char* name;
  double scale;  ///< deg/h or arcsec; 0: pulses
};
constexpr Unit kRates[] = {
    {"deg/h", 1}, {"arcsec/s", 1}, {"deg/s", kArcsecPerDegree}, {"rad/s", kArcsecPerRadian}, {"pulse/s", 0}};
constexpr Unit kAngles[] = {{"pulse", 0}, {"arcsec", 1}, {"deg", kArcsecPerDegree}, {"rad", kArcsecPerRadian}};

std::vector<const char*> names_of(std::span<const Unit> units) {
  std::vector<const char*> names;
  for (const Unit& unit : units) names.push_back(unit.name);
  return names;
}

/// Sets each axis's scale: deg/h or arcsec for one unit of its number. For pulses it is the gyro's own scale factor,
/// which the choice may override.
void read_unit(const Section& s, FrameDraft& draft) {
  FrameDescription& description = draft.description;
  const std::span<const Unit> units =
      description.gyro.meaning == RateEncoding::kRate ? std::span<const Unit>(kRates) : kAngles;
  const Unit& unit = units[s.choice("unit", names_of(units))];
  const bool pulses = unit.scale == 0;
  if (!pulses && s.has("arcsec_per_pulse"))
    s.fail("arcsec_per_pulse", "has no meaning with this unit; expected unit \"pulse\"");
  if (pulses) s.require("arcsec_per_pulse");
  for (std::size_t i = 0; i < draft.choice.axes.size(); ++i) {
    const AxisChoice& axis = draft.choice.axes[i];
    if (!pulses && axis.scale_factor_arcsec_per_pulse)
      s.fail("unit", fmt::format("is \"{}\": a scale factor in arcsec/pulse does not apply", unit.name));
    const double scale = pulses ? draft.arcsec_per_pulse : unit.scale;
    description.axes[i].scale = axis.scale_factor_arcsec_per_pulse.value_or(scale) * axis.sign;
  }
}

/// Adds the rule to the served axes from `first` to before `end`.
void add_valid(const Section& s, const BitsDraft& bits, FrameDescription& description, std::size_t first,
               std::size_t end) {
  if ((bits.value & ~bits.mask) != 0)
    s.fail("value",
           fmt::format("found {}, expected bits of the mask {}: (field & mask) is compared", bits.value, bits.mask));
  assign(s, "field", {bits.field}, description, [&](MessageFields& roles, int field) {
    for (std::size_t i = first; i < end; ++i) roles.axes[i].valid.push_back({field, bits.mask, bits.value});
  });
}

/// An axis as it is read: the description, and which of the served axes it is.
struct AxisDraft {
  std::vector<std::string> field;
  double sign = 1;
  std::string temperature;
  std::vector<std::pair<Section, BitsDraft>> valid;
};

const JsonTable<AxisDraft>& axis_keys() {
  using A = AxisDraft;
  static const JsonTable<A> keys =
      JsonTable<A>()
          .texts("field", &A::field, kRequired)
          .value(
              "sign", {{"type", "number"}, {"enum", {1, -1}}}, &A::sign, "",
              [](const Section& s, const std::string& key) {
                const double sign = s.number(key, {-1, 1});
                if (std::abs(sign) != 1) s.fail(key, fmt::format("found {}, expected 1 or -1", sign));
                return sign;
              },
              [](double sign) { return Json(sign); })
          .text("temperature", &A::temperature,
                "one of \"sensors\": the axis's own thermometer, for configurations that name axes")
          .objects(
              JsonTable<A>::Form::kOneOrMore, "valid", bits_keys(true, false),
              [](const Section& s, const std::string&, const BitsDraft& bits, A& axis) {
                axis.valid.emplace_back(s, bits);
              },
              "valid if (field & mask) == value");
  return keys;
}

/// Sets the sensor that is the axis's own thermometer.
void set_thermometer(const Section& s, const std::string& name, const FrameDescription& description, AxisRule& axis) {
  const std::span<const Channel> sensors = description.sensors();
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    if (sensors[k].sensor.name == name) axis.thermometer = static_cast<int>(k);
  }
  if (axis.thermometer < 0)
    return s.fail("temperature", fmt::format("found \"{}\", expected one of \"sensors\"", name));
  const std::string& unit = sensors[static_cast<std::size_t>(axis.thermometer)].sensor.unit;
  if (unit != "degC") s.fail("temperature", fmt::format("\"{}\" is in {}, expected degC", name, unit));
}

/// Reads one axis served at index `i`: fields, sign and validity; or only the names of its fields.
void read_axis(const Section& axes, const std::string& name, FrameDescription& description, std::size_t i) {
  const auto give = [i](MessageFields& roles, int field) { roles.axes[i].gyro.push_back(field); };
  if (!axes.is_object(name)) return assign(axes, name, axes.texts(name), description, give);
  const Section s = axes.object(name);
  AxisDraft axis;
  axis_keys().read(s, axis);
  assign(s, "field", axis.field, description, give);
  description.axes[i].scale *= axis.sign;
  if (s.has("temperature")) set_thermometer(s, axis.temperature, description, description.axes[i]);
  for (const auto& [of_rule, bits] : axis.valid) add_valid(of_rule, bits, description, i, i + 1);
}

/// Adds the chosen axes to the description. Reads the others, too, so that an error in them is found at once.
void read_axes(const Section& gyro, FrameDraft& draft) {
  FrameDescription& description = draft.description;
  const Section axes = gyro.object("axes", true);
  const std::vector<std::string>& names = description.axis_names = axes.names(TextRule::kAxisName);
  if (!gyro.good()) return;
  if (names.empty()) return gyro.fail("axes", "found none, expected at least one axis");
  for (std::size_t i = 0; i < draft.choice.axes.size(); ++i) {
    std::string& chosen = description.axes[i].name;
    chosen = draft.choice.axes[i].axis.empty() ? names.front() : draft.choice.axes[i].axis;
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

Json axes_schema() {
  const Json names = fields_keys().schema()["properties"]["field"];
  return {
      {"type", "object"}, {"minProperties", 1}, {"additionalProperties", {{"anyOf", {names, axis_keys().schema()}}}}};
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
void add_corrected(const Section& s, const std::string&, const BitsDraft& bits, FrameDraft& draft) {
  FrameDescription& description = draft.description;
  const std::uint64_t mask = bits.mask;
  if (mask == 0) s.fail("mask", "found 0, expected the bits of a corrected frame");
  assign(s, "field", {bits.field}, description, [&](MessageFields& roles, int field) {
    roles.corrected.push_back({field, mask, mask});
  });
  for (const MessageType& kind : description.kinds) {
    for (const BitsRule& rule : kind.roles.corrected) {
      const Field& field = kind.fields[static_cast<std::size_t>(rule.field)];
      if (kind.structure == Structure::kColumns || !is_whole(field))
        s.fail("field", fmt::format("\"{}\" is not an integer of a binary frame, which has bits", field.name));
      for (const AxisRoles& axis : kind.roles.axes) {
        for (const BitsRule& valid : axis.valid) {
          if (valid.field == rule.field && (valid.mask & mask) != 0)
            s.fail("mask", fmt::format("has bits of \"valid\", which the device sets in \"{}\"", field.name));
        }
      }
    }
  }
}

void read_meaning(const Section& s, FrameDraft& draft) {
  FrameDescription& description = draft.description;
  description.gyro.meaning =
      static_cast<RateEncoding>(s.explained_choice("meaning", {{"rate", "angular rate"},
                                                               {"increment", "angle since the last frame"},
                                                               {"accumulated", "running total of the angle"}}));
  description.axes.resize(draft.choice.axes.size());
  for (MessageType& kind : description.kinds) kind.roles.axes.resize(draft.choice.axes.size());
}

Json range_schema(Range allowed) {
  return {{"type", "array"}, {"minItems", 2}, {"maxItems", 2}, {"items", limits_schema("number", allowed)}};
}

JsonTable<FrameDraft> gyro_keys() {
  using F = FrameDraft;
  using Form = JsonTable<F>::Form;
  std::vector<const char*> units = names_of(kRates);
  for (const char* unit : {"pulse", "arcsec", "deg", "rad"}) units.push_back(unit);
  const auto interval = [](auto& draft) -> auto& { return draft.description.gyro.interval_s; };
  const auto range = [](auto& draft) -> auto& { return draft.description.plausible.rate.range; };
  return JsonTable<F>()
      .custom("meaning", {{"type", "string"}, {"enum", {"rate", "increment", "accumulated"}}}, "", read_meaning,
              nullptr)
      .also({}, true)
      .number("arcsec_per_pulse", {1e-9, 1e6}, &F::arcsec_per_pulse, "required for pulses")
      .custom("unit", {{"type", "string"}, {"enum", units}}, "", read_unit, nullptr)
      .also({}, true)
      .number("interval_s", {1e-6, 1e4}, interval, "increment: the time it covers, if not one frame")
      .then([](const Section& s, F& draft) {
        const GyroRule& gyro = draft.description.gyro;
        if (gyro.interval_s != 0 && gyro.meaning != RateEncoding::kIncrement)
          s.fail("interval_s", "only valid for an increment");
      })
      .value(
          "range_deg_per_s", range_schema(kRateRanges), range,
          "range of measurable rates: others are implausible; default: -10000 to 10000",
          [](const Section& s, const std::string& key) {
            return read_range(s, key.c_str(), kRateRanges, kDegPerSInDegPerH).value_or(kAnyNumber);
          },
          [](const Range&) { return Json(); })
      .objects(
          Form::kOneOrMore, "valid", bits_keys(true, false),
          [](const Section& s, const std::string&, const BitsDraft& bits, F& draft) {
            add_valid(s, bits, draft.description, 0, draft.description.axes.size());
          },
          "valid if (field & mask) == value")
      .custom("axes", axes_schema(), "names that a configuration may choose; the first is the default", read_axes,
              nullptr)
      .also({}, true)
      .objects(Form::kOne, "corrected", bits_keys(false, true), add_corrected,
               "bits that the device leaves unused: set in corrected frames of an output")
      .custom(
          "wrap", limits_schema("number", {0, 1e18}),
          "accumulated: modulus in the field's unit; default: the range of its bits; 0: never",
          [](const Section& s, F& draft) { read_wrap(s, draft.description); }, nullptr);
}

// The counter.

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

struct CounterDraft {
  CounterRule rule;
  std::vector<std::string> field;
};

void add_counter(const Section& s, const std::string&, const CounterDraft& draft, FrameDraft& frames) {
  FrameDescription& description = frames.description;
  CounterRule& rule = description.counter.emplace(draft.rule);
  assign(s, draft.field, description, &MessageFields::counter);
  for (const MessageType& kind : description.kinds) {
    for (const int at : kind.roles.counter) check_counter_field(s, kind.fields[static_cast<std::size_t>(at)]);
  }
  const Field* field = first_with(description, [](const MessageFields& roles) { return &roles.counter; });
  const std::uint64_t own = field == nullptr ? 0 : natural_modulus(*field);
  if (!s.has("modulus")) rule.modulus = own;
  if (own != 0 && rule.modulus > own)
    s.fail("modulus", fmt::format("{} is more than the field's {}", rule.modulus, own));
  rule.step_follows_rate = rule.ticks_per_s > 0 && !s.has("step");
  if (!s.has("step")) rule.ticks_per_frame = rule.ticks_per_s > 0 ? rule.ticks_per_s / description.rate_hz : 1;
  if (rule.ticks_per_s == 0) rule.ticks_per_s = rule.ticks_per_frame * description.rate_hz;
  if (rule.modulus != 0 && rule.ticks_per_frame >= static_cast<double>(rule.modulus)) {
    s.fail("modulus", fmt::format("{} is not above the step of {} ticks a frame", rule.modulus, rule.ticks_per_frame));
  }
}

JsonTable<CounterDraft> counter_keys() {
  using C = CounterRule;
  return JsonTable<CounterDraft>()
      .texts("field", &CounterDraft::field, kRequired)
      .group(JsonTable<C>()
                 .bits("modulus", &C::modulus, "default: the range of its bits")
                 .boolean("step_varies", &C::step_varies, "externally triggered: a larger step is not a loss")
                 .number("ticks_per_s", {1e-3, 1e10}, &C::ticks_per_s, "for counters of samples or of time")
                 .number("step", {1e-3, 1e10}, &C::ticks_per_frame,
                         "ticks from one counted frame to the next; default 1, or ticks_per_s / rate_hz"),
             &CounterDraft::rule);
}

// Channels.

/// A channel as it is read.
struct ChannelDraft {
  Channel channel;
  std::vector<std::string> field;
  std::string high, low;
  int unit = 0;
  SensorStatement plausible;
};

/// Stores the draft as channel `i`, with its fields in each message type. Returns the first field that has it in one
/// piece.
const Field* add_channel(const Section& s, const ChannelDraft& draft, FrameDescription& description, std::size_t i) {
  Channel& channel = description.channels[i];
  const SensorName sensor = channel.sensor;
  const ChannelRole role = channel.role;
  channel = draft.channel;
  channel.sensor = sensor, channel.role = role, channel.present = true;
  if (s.has("field")) {
    for (const char* key : {"high", "low", "low_bits", "bits", "signed", "scale", "offset", "min", "max", "convert"}) {
      if (s.has(key)) s.fail(key, "only valid for halves (\"high\", \"low\"); with \"field\" set it in the field");
    }
    assign(s, "field", draft.field, description,
           [i](MessageFields& roles, int field) { roles.channels[i].whole.push_back(field); });
    return first_with(description, [i](const MessageFields& roles) { return &roles.channels[i].whole; });
  }
  const auto assign_half = [&](const char* key, const std::string& name, int ChannelFields::*half) {
    s.require(key);
    assign(s, key, {name}, description, [&](MessageFields& roles, int field) { roles.channels[i].*half = field; });
  };
  assign_half("high", draft.high, &ChannelFields::high);
  assign_half("low", draft.low, &ChannelFields::low);
  return nullptr;
}

JsonTable<ChannelDraft> channel_keys() {
  using C = Channel;
  const auto scaling = [](auto& channel) -> auto& { return channel.joined; };
  return JsonTable<ChannelDraft>()
      .texts("field", &ChannelDraft::field, "")
      .text("high", &ChannelDraft::high, "halves in consecutive frames")
      .text("low", &ChannelDraft::low, "")
      .group(
          JsonTable<C>()
              .number("stale_after_s", {0, 3600}, &C::stale_after_s, "a value is kept this long over frames without it")
              .integer("low_bits", {1, 32}, &C::low_bits, "")
              .integer("bits", {2, 64}, &C::bits, "")
              .boolean("signed", &C::is_signed, "")
              .group(scaling_keys(), scaling),
          &ChannelDraft::channel);
}

/// Of the temperature and the UHFO voltage.
JsonTable<ChannelDraft> limited_channel_keys() {
  using P = SensorStatement;
  return channel_keys().group(
      JsonTable<P>()
          .value(
              "range", range_schema(kChannelRanges), &P::range,
              "degC or V: values outside are implausible; default: -90 to 200 degC, -1000 to 1000 V",
              [](const Section& s, const std::string& key) {
                return read_range(s, key.c_str(), kChannelRanges).value_or(kAnyNumber);
              },
              [](const Range&) { return Json(); })
          .number("greatest_slope_degc_per_s", {1e-6, 1e6}, &P::greatest_slope_per_s,
                  "temperature: faster changes are implausible; default 1"),
      &ChannelDraft::plausible);
}

/// Call before the axes are read: they refer to thermometers among the sensors.
void add_sensor(const Section& s, const std::string& name, const ChannelDraft& draft, FrameDraft& frames) {
  FrameDescription& description = frames.description;
  if (!is_sensor_name(name) || name.find('.') != std::string::npos)
    s.fail("", "invalid sensor name, expected letters, digits and _, not T, U or dTdt");
  const char* const unit = kSensorUnitNames[static_cast<std::size_t>(draft.unit)];
  description.channels.push_back({.sensor = {name, unit}});
  for (MessageType& kind : description.kinds) kind.roles.channels.emplace_back();
  const Field* field = add_channel(s, draft, description, description.channels.size() - 1);
  if (field && !field->unit.empty() && field->unit != unit)
    s.fail("unit", fmt::format("found {}, but the field \"{}\" is in {}", unit, field->name, field->unit));
}

void leave_sensors_out(FrameDescription& description) {
  description.channels.resize(kRoleChannels);
  for (MessageType& kind : description.kinds) kind.roles.channels.resize(kRoleChannels);
  for (AxisRule& axis : description.axes) axis.thermometer = -1;
}

/// A channel with a role of its own: its key, and how to convert a usual unit of its field to its own.
struct RoleChannel {
  const char *key, *help, *usual_unit, *remedy;
  SensorStatement SensorStatements::*limits;
};
constexpr RoleChannel kRoles[kRoleChannels] = {
    {"temperature", "a slow quantity: one field, or two halves", "K",
     "; add \"offset\": -273.15 to the field, and make its \"unit\" degC", &SensorStatements::temperature},
    {"uhfo", "the voltage of the high-frequency oscillator", "mV",
     "; divide the field's \"scale\" by 1000, and make its \"unit\" V", &SensorStatements::uhfo}};

void add_role_channel(const Section& s, const ChannelDraft& draft, FrameDescription& description, std::size_t i) {
  const RoleChannel& role = kRoles[i];
  const std::string& unit = description.channels[i].sensor.unit;
  const Field* field = add_channel(s, draft, description, i);
  if (field && !field->unit.empty() && field->unit != unit)
    s.fail("field", fmt::format("the field \"{}\" is in {}, expected {}{}", field->name, field->unit, unit,
                                field->unit == role.usual_unit ? role.remedy : ""));
  description.plausible.*role.limits = draft.plausible;
  if (draft.plausible.greatest_slope_per_s && description.channels[i].role != ChannelRole::kTemperature)
    s.fail("greatest_slope_degc_per_s", "only valid for the temperature");
}

JsonTable<FrameDraft> role_channel_keys() {
  using F = FrameDraft;
  JsonTable<F> keys;
  for (std::size_t i = 0; i < kRoleChannels; ++i) {
    keys.objects(
        JsonTable<F>::Form::kOne, kRoles[i].key, limited_channel_keys(),
        [i](const Section& s, const std::string&, const ChannelDraft& draft, F& frames) {
          add_role_channel(s, draft, frames.description, i);
        },
        kRoles[i].help);
  }
  return keys;
}

/// A gyro, or an instrument with sensors only.
void check_purpose(const Section& s, FrameDraft&) {
  if (s.has("gyro")) return;
  if (!s.has("sensors")) return s.require("gyro");
  for (const char* key : {"temperature", "uhfo", "latency", "status"}) {
    if (s.has(key)) s.fail(key, "only valid with \"gyro\"; use \"sensors\" instead");
  }
}

}  // namespace

JsonTable<FrameDraft> role_keys() {
  using F = FrameDraft;
  using Form = JsonTable<F>::Form;
  const auto add_role = [](FieldList MessageFields::*role) {
    return [role](const Section& s, const std::string&, const std::vector<std::string>& fields, F& frames) {
      assign(s, fields, frames.description, role);
    };
  };
  return JsonTable<F>()
      .then([](const Section& s, F&) {
        const std::size_t sensors = s.object("sensors").names(TextRule::kSensorName).size();
        if (sensors > kMaxSensors)
          s.fail("sensors", fmt::format("found {} sensors, expected at most {}", sensors, kMaxSensors));
      })
      .objects(Form::kNamed, "sensors",
               channel_keys().choice("unit", kSensorUnitNames, &ChannelDraft::unit, {kRequired, "of the field"}),
               add_sensor, "further channels by name, for configurations that name axes", TextRule::kSensorName)
      .then(check_purpose)
      .object("gyro", gyro_keys(), std::identity(), "")
      .objects(Form::kOne, "counter", counter_keys(), add_counter, "counts frames, samples or time; an integer")
      .group(role_channel_keys())
      .then([](const Section&, F& draft) {
        if (!draft.choice.sensors && draft.description.carries_gyro()) leave_sensors_out(draft.description);
      })
      .objects(Form::kOne, "status", fields_keys(), add_role(&MessageFields::status), "status bits, passed through")
      .objects(Form::kOne, "latency", fields_keys(), add_role(&MessageFields::latency),
               "delay that the frame states, s");
}

}  // namespace prism::wire
