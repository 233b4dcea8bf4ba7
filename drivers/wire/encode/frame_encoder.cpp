// SPDX-License-Identifier: MIT
// Writes one frame: blank, selectors, counter, gyro, channels, status, constants, checks; or edits a received one.
#include "drivers/wire/encode/frame_encoder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/wire/description/frame_view.hpp"
#include "drivers/wire/description/text_template.hpp"

namespace prism::wire {
namespace {

/// Another value of the field that `when` names leaves it out.
bool marks_absent(const Field& field) { return field.when.values.size() == 1; }

/// x modulo m, in [0, m).
double modulo(double x, double m) {
  const double rest = std::fmod(x, m);
  return rest < 0 ? rest + m : rest;
}

// A frame with all constant parts of its message type: sync, length, item headers, defaults.

/// Number of bytes covered by the fields of an item.
std::uint32_t payload_of(const MessageType& kind, std::size_t item) {
  std::uint32_t size = 0;
  for (const Field& field : kind.fields) {
    if (field.item == static_cast<int>(item) && field.at >= 0)
      size = std::max(size, static_cast<std::uint32_t>(field.at) + field.size);
  }
  return size;
}

std::vector<std::uint8_t> items_of(const MessageType& kind) {
  const ItemRule& rule = kind.items;
  std::vector<std::uint8_t> out;
  for (const std::uint64_t id : rule.sent.empty() ? rule.ids : rule.sent) {
    const auto index = static_cast<std::size_t>(std::find(rule.ids.begin(), rule.ids.end(), id) - rule.ids.begin());
    const std::uint32_t payload = payload_of(kind, index);
    const std::uint32_t length =
        payload + (rule.length_includes_header ? std::uint32_t{rule.id_size} + rule.length_size : 0);
    if (rule.length_first) append_number(out, length, rule.length_size, rule.big_endian);
    append_number(out, id, rule.id_size, rule.big_endian);
    if (!rule.length_first) append_number(out, length, rule.length_size, rule.big_endian);
    out.resize(out.size() + payload);
  }
  return out;
}

std::size_t blocks_length(const MessageType& kind) {
  auto mask = static_cast<std::uint64_t>(kind.fields[static_cast<std::size_t>(kind.blocks.mask_field)].preset);
  std::size_t length = 0;
  for (const std::uint32_t size : kind.blocks.sizes) {
    length += (mask & 1) != 0 ? size : 0;
    mask >>= 1;
  }
  return length;
}

/// Bytes after the part of variable length: for checks and fields positioned from the end.
std::size_t tail_of(const MessageType& kind) {
  int tail = 0;
  for (const CheckRule& check : kind.checks) tail = std::max(tail, -check.at);
  for (const Field& field : kind.fields) tail = std::max(tail, field.item < 0 ? -field.at : 0);
  return static_cast<std::size_t>(tail);
}

void write_presets(const MessageType& kind, std::vector<std::uint8_t>& frame) {
  FrameView view;
  for (const Field& field : kind.fields) {
    if (field.preset == 0 || !view.look_at(kind, frame)) continue;
    if (const std::uint8_t* at = view.find(field))
      store_number(field, frame.data() + (at - frame.data()), field.preset);
  }
}

/// The terminator, and digits where fields have hexadecimal ones.
void write_characters(const MessageType& kind, std::vector<std::uint8_t>& frame) {
  const std::vector<std::uint8_t>& end = kind.length.terminator;
  if (end.size() <= frame.size())
    std::copy(end.begin(), end.end(), frame.end() - static_cast<std::ptrdiff_t>(end.size()));
  const auto length = static_cast<std::ptrdiff_t>(frame.size());
  for (const Field& field : kind.fields) {
    const std::ptrdiff_t at = field.at < 0 ? length + field.at : field.at;
    if (field.is_hex() && at >= 0 && at + field.size <= length)
      std::fill_n(frame.begin() + at, field.size, std::uint8_t{'0'});
  }
}

/// Writes all checks of the frame; hexadecimal digits in lower or upper case. A check may cover another check: repeats
/// as often as there are checks.
void store_checks(const MessageType& kind, std::span<std::uint8_t> frame, bool lower_case = false) {
  for (std::size_t round = 0; round < kind.checks.size(); ++round) {
    for (const CheckRule& check : kind.checks) store_check(check, frame, lower_case);
  }
}

/// Writes the constant bits (sync, body rules) again after the fields were written.
void apply_constants(const MessageType& kind, std::span<std::uint8_t> frame) {
  const auto length = static_cast<int>(frame.size());
  for (const BodyRule& rule : kind.body) {
    const int to = rule.to <= 0 ? length + rule.to : rule.to;
    for (int i = rule.from < 0 ? length + rule.from : rule.from; i < std::min(to, length); ++i) {
      auto& byte = frame[static_cast<std::size_t>(i)];
      byte = static_cast<std::uint8_t>((byte & ~rule.mask) | rule.value);
    }
  }
  for (const ByteRule& rule : kind.sync) {
    if (rule.at < frame.size()) frame[rule.at] = static_cast<std::uint8_t>((frame[rule.at] & ~rule.mask) | rule.value);
  }
}

/// Binary message types only. Does not fill in checks.
std::vector<std::uint8_t> blank_frame(const MessageType& kind) {
  std::vector<std::uint8_t> frame(kind.length.min);
  if (kind.structure == Structure::kItems) {
    frame.assign(static_cast<std::size_t>(kind.items.from), 0);
    const std::vector<std::uint8_t> items = items_of(kind);
    frame.insert(frame.end(), items.begin(), items.end());
    frame.resize(std::max<std::size_t>(frame.size() + static_cast<std::size_t>(-kind.items.to), kind.length.min));
  } else if (kind.structure == Structure::kBlocks) {
    frame.assign(static_cast<std::size_t>(kind.blocks.from) + blocks_length(kind) + tail_of(kind), 0);
    const Field& mask = kind.fields[static_cast<std::size_t>(kind.blocks.mask_field)];
    store_number(mask, frame.data() + mask.at, mask.preset);
  }
  if (kind.length.form == LengthRule::LengthType::kField) {
    const Field& field = kind.length.field;
    const std::int64_t value = static_cast<std::int64_t>(frame.size()) - kind.length.add;
    store_bits(field, frame.data() + field.at, static_cast<std::uint64_t>(value));
  }
  write_characters(kind, frame);
  apply_constants(kind, frame);
  write_presets(kind, frame);
  return frame;
}

}  // namespace

void append_number(std::vector<std::uint8_t>& out, std::uint64_t value, std::size_t size, bool big_endian) {
  for (std::size_t i = 0; i < size; ++i)
    out.push_back(static_cast<std::uint8_t>(value >> 8 * (big_endian ? size - 1 - i : i)));
}

FrameEncoder::FrameEncoder(FrameDescriptionPtr description) : description_(std::move(description)) {
  for (const MessageType& kind : description_->kinds) {
    blanks_.push_back(kind.structure == Structure::kColumns ? std::vector<std::uint8_t>{} : blank_frame(kind));
  }
  find_selectors();
}

void FrameEncoder::find_selectors() {
  for (const MessageType& kind : description_->kinds) {
    std::vector<Selector>& selectors = selectors_.emplace_back();
    for (const Field& field : kind.fields) {
      const int selector = field.when.field;
      const auto& counters = kind.roles.counter;
      if (selector < 0 || std::find(counters.begin(), counters.end(), selector) != counters.end()) continue;
      auto known =
          std::find_if(selectors.begin(), selectors.end(), [&](const Selector& s) { return s.field == selector; });
      if (known == selectors.end()) known = selectors.insert(selectors.end(), Selector{selector, {}});
      for (const std::uint64_t value : field.when.values) {
        if (std::find(known->values.begin(), known->values.end(), value) == known->values.end())
          known->values.push_back(value);
      }
    }
    for (Selector& selector : selectors) std::sort(selector.values.begin(), selector.values.end());
  }
}

std::uint8_t* FrameEncoder::find(const Field& field) {
  const std::uint8_t* at = view_.find(field);
  return at == nullptr ? nullptr : frame_.data() + (at - frame_.data());
}

void FrameEncoder::put_number(int field, double raw) {
  const auto index = static_cast<std::size_t>(field);
  if (kind_->structure == Structure::kColumns) {
    raw_[index] = raw;
    return;
  }
  const Field& written = kind_->fields[index];
  if (std::uint8_t* at = find(written)) store_number(written, at, raw);
}

void FrameEncoder::put_bits(int field, std::uint64_t bits) {
  const auto index = static_cast<std::size_t>(field);
  if (kind_->structure == Structure::kColumns) {
    const bool is_signed = kind_->fields[index].type == NumberType::kSigned;
    raw_[index] = is_signed ? static_cast<double>(static_cast<std::int64_t>(bits)) : static_cast<double>(bits);
    return;
  }
  const Field& written = kind_->fields[index];
  if (std::uint8_t* at = find(written)) store_bits(written, at, bits);
}

void FrameEncoder::write_selectors(int kind) {
  for (const Selector& selector : selectors_[static_cast<std::size_t>(kind)]) {
    std::size_t turn = 0;
    if (selector.values.size() > 1) turn = frame_number_ / description_->sent_kinds.size() % selector.values.size();
    put_bits(selector.field, selector.values[turn]);
  }
}

void FrameEncoder::write_counter(const MessageFields& roles) {
  for (const int field : roles.counter) put_bits(field, static_cast<std::uint64_t>(std::llround(ticks_)));
}

void FrameEncoder::write_axis(const FieldList& fields, const GyroState& state, std::size_t axis) {
  const GyroRule& gyro = description_->gyro;
  const double rate = state.rate_deg_per_h[axis] / description_->axes[axis].scale;
  double sent = 0;
  for (const int index : fields) {
    const Field& field = kind_->fields[static_cast<std::size_t>(index)];
    const double value = gyro.meaning == RateEncoding::kRate ? rate : angles_[axis];
    const double raw = raw_number(field, value, description_->axes[axis].wrap);
    put_number(index, raw);
    if (gyro.meaning == RateEncoding::kIncrement) sent = field.scaling.apply(raw);
  }
  angles_[axis] -= sent;
}

void FrameEncoder::write_channel(const Channel& channel, const ChannelFields& fields, double value,
                                 std::uint64_t& latched) {
  const int high = fields.high, low = fields.low;
  for (const int field : fields.whole) {
    const Field& f = kind_->fields[static_cast<std::size_t>(field)];
    if (std::isnan(value) && marks_absent(f))
      put_bits(f.when.field, ~f.when.values.front());
    else
      put_number(field, f.scaling.invert(value));
  }
  if (high < 0 || low < 0) return;
  if (find(kind_->fields[static_cast<std::size_t>(high)]) != nullptr) {
    const double raw = channel.joined.invert(value);
    const double limit = std::ldexp(1.0, channel.bits - (channel.is_signed ? 1 : 0));
    const double held =
        std::clamp(std::nearbyint(std::isfinite(raw) ? raw : 0), channel.is_signed ? -limit : 0.0, limit - 1);
    latched = static_cast<std::uint64_t>(static_cast<std::int64_t>(held));
    put_bits(high, latched >> channel.low_bits);
  }
  if (find(kind_->fields[static_cast<std::size_t>(low)]) != nullptr) put_bits(low, latched);
}

void FrameEncoder::write_valid(const AxisRoles& roles, bool valid) {
  for (const BitsRule& rule : roles.valid) {
    const auto index = static_cast<std::size_t>(rule.field);
    const bool text = kind_->structure == Structure::kColumns;
    const std::uint64_t old = text ? static_cast<std::uint64_t>(std::max(raw_[index], 0.0)) : view_.bits(rule.field);
    const std::uint64_t bits = valid ? rule.value : ~rule.value;
    put_bits(rule.field, (old & ~rule.mask) | (bits & rule.mask));
  }
}

void FrameEncoder::write_status(const MessageFields& roles, const GyroState& state) {
  for (const int field : roles.status) put_bits(field, state.status);
  // Axes can share bits: the bits of a valid axis have priority.
  for (const bool valid : {false, true}) {
    for (std::size_t i = 0; i < roles.axes.size(); ++i) {
      if (state.valid[i] == valid) write_valid(roles.axes[i], valid);
    }
  }
}

// The frame includes the angle of its interval, so counter and angle advance before they are written.
void FrameEncoder::turn(const GyroState& state) {
  const GyroRule& gyro = description_->gyro;
  ++frame_number_;
  if (description_->counter) {
    const CounterRule& rule = *description_->counter;
    ticks_ += rule.ticks_per_frame;
    if (rule.modulus != 0) ticks_ = modulo(ticks_, static_cast<double>(rule.modulus));
  }
  if (gyro.meaning == RateEncoding::kRate) return;
  for (std::size_t i = 0; i < description_->axes.size(); ++i)
    angles_[i] += state.rate_deg_per_h[i] * state.interval_s / description_->axes[i].scale;
}

void FrameEncoder::skip(const GyroState& state, std::uint64_t frames) {
  const auto angles = angles_;
  for (std::uint64_t i = 0; i < frames; ++i) turn(state);
  if (description_->gyro.meaning == RateEncoding::kIncrement) angles_ = angles;
}

void FrameEncoder::begin_frame(int kind, const GyroState& state) {
  const auto index = static_cast<std::size_t>(kind);
  kind_ = &description_->kinds[index];
  frame_ = blanks_[index];
  if (kind_->structure == Structure::kColumns) {
    raw_.resize(kind_->fields.size());
    for (std::size_t f = 0; f < raw_.size(); ++f) raw_[f] = kind_->fields[f].preset;
  } else {
    view_.look_at(*kind_, frame_);
  }
  write_status(kind_->roles, state);
  write_selectors(kind);
}

const MessageType* FrameEncoder::next_kind() const {
  const auto& kinds = description_->sent_kinds;
  return kinds.empty() ? nullptr : &description_->kinds[static_cast<std::size_t>(kinds[frame_number_ % kinds.size()])];
}

double FrameEncoder::value_of(std::size_t channel, const GyroState& state) const {
  const ChannelRole role = description_->channels[channel].role;
  return role == ChannelRole::kTemperature ? state.temperature_degc
         : role == ChannelRole::kUhfo      ? state.uhfo_v
                                           : state.sensors[channel - kRoleChannels];
}

bool FrameEncoder::can_state(const GyroState& state) const {
  const MessageType* const kind = next_kind();
  if (kind == nullptr) return true;
  for (std::size_t i = 0; i < kind->roles.axes.size(); ++i) {
    const AxisRoles& axis = kind->roles.axes[i];
    if (!state.valid[i] && !axis.gyro.empty() && axis.valid.empty()) return false;
  }
  const auto marks = [&](int field) { return marks_absent(kind->fields[static_cast<std::size_t>(field)]); };
  for (std::size_t i = 0; i < description_->channels.size(); ++i) {
    const ChannelFields& fields = kind->roles.channels[i];
    if (std::isnan(value_of(i, state)) && (fields.high >= 0 || !std::ranges::all_of(fields.whole, marks))) return false;
  }
  return true;
}

void FrameEncoder::encode(const GyroState& state, std::vector<std::uint8_t>& out) {
  const MessageType* const kind = next_kind();
  if (kind == nullptr) return;  // the columns are not chosen yet: nothing to send
  turn(state);
  begin_frame(static_cast<int>(kind - description_->kinds.data()), state);
  const MessageFields& roles = kind_->roles;
  write_counter(roles);
  for (std::size_t i = 0; i < roles.axes.size(); ++i) write_axis(roles.axes[i].gyro, state, i);
  latched_.resize(description_->channels.size());
  for (std::size_t n = 0; n < latched_.size(); ++n) {
    const std::size_t i = (n + kRoleChannels) % latched_.size();  // T and U last: they may be fields of sensors
    write_channel(description_->channels[i], roles.channels[i], value_of(i, state), latched_[i]);
  }
  if (kind_->structure == Structure::kColumns)
    frame_ = print_frame(*kind_, raw_);
  else
    apply_constants(*kind_, frame_);
  store_checks(*kind_, frame_);
  out.insert(out.end(), frame_.begin(), frame_.end());
  out.insert(out.end(), kind_->trailer.begin(), kind_->trailer.end());
}

double raw_number(const Field& field, double value, double wrap) {
  const bool is_signed = field.type == NumberType::kSigned;
  double raw = field.scaling.invert(value);
  if (is_signed || field.type == NumberType::kUnsigned) raw = std::nearbyint(raw);
  if (wrap == 0) return raw;
  const double turn = wrap / std::abs(field.scaling.scale);
  const bool centred = is_signed || field.type == NumberType::kFloat32 || field.type == NumberType::kFloat64;
  const double low = centred && field.scaling.admits(field.scaling.apply(-turn / 2)) ? -turn / 2 : 0;
  return raw - turn * std::floor((raw - low) / turn);
}

// Replaces numbers in a received frame.

std::string print_like(std::string_view found, double number, char point, bool with_plus) {
  const std::size_t dot = std::min(found.find(point), found.size() - 1), decimals = found.size() - 1 - dot;
  const std::string_view digits = found.substr(found.find_first_not_of("+-"));
  const bool zeros = digits.size() > 1 && digits[0] == '0' && digits[1] != point;
  if (std::abs(number) <= 0.5 * std::pow(10, -static_cast<double>(decimals))) number = 0;  // without a sign
  const char* const form = with_plus || found[0] == '+' ? "{:+0{}.{}f}" : "{:0{}.{}f}";
  std::string text = fmt::format(fmt::runtime(form), number, zeros ? found.size() : 0, decimals);
  std::replace(text.begin(), text.end(), '.', point);
  return text;
}

void FrameEditor::begin(std::int32_t kind, std::span<const std::uint8_t> frame) {
  kind_ = &description_->kinds[static_cast<std::size_t>(kind)];
  frame_.assign(frame.begin(), frame.end());
  view_.look_at(*kind_, frame_);
  before_ = frame_;
  store_checks(*kind_, before_);
  if (before_ != frame_) lower_case_ = true;  // the check is right: only the case of its digits can differ
}

double FrameEditor::put(std::size_t axis, double value) {
  before_ = frame_;
  double found = kUnknown;
  for (const int index : kind_->roles.axes[axis].gyro) {
    if (std::isnan(view_.value(index))) continue;
    const bool written = write(static_cast<std::size_t>(index), value, description_->axes[axis].wrap);
    if (!written || !view_.look_at(*kind_, frame_) || std::isnan(view_.value(index))) {
      frame_ = before_;
      view_.look_at(*kind_, frame_);
      return kUnknown;
    }
    if (std::isnan(found)) found = view_.value(index);
  }
  return found;
}

bool FrameEditor::write(std::size_t index, double value, double wrap) {
  const Field& field = kind_->fields[index];
  const double raw = raw_number(field, value, wrap);
  if (!std::isfinite(raw)) return false;
  if (view_.is_text() || field.type == NumberType::kDigits) return write_text(field, raw);
  std::uint8_t* const at = frame_.data() + (view_.find(field) - frame_.data());
  store_number(field, at, raw);
  return field.type == NumberType::kFloat32 || load_number(field, at) == raw;  // else it is beyond the field's limits
}

// Keeps the width of the column where blanks before the number allow it.
bool FrameEditor::write_text(const Field& field, double raw) {
  if (field.type == NumberType::kHexText || field.is_hex()) return false;
  const bool is_column = view_.is_text();
  const std::span<const std::uint8_t> place =
      is_column ? view_.column(field) : std::span<const std::uint8_t>(view_.find(field), field.size);
  const std::string_view found(reinterpret_cast<const char*>(place.data()), place.size());
  if (found.find_first_of("eE") != std::string_view::npos) return false;
  has_plus_ = has_plus_ || found.find('+') != std::string_view::npos;
  std::string text = print_like(found.substr(found.find_first_not_of(' ')), raw, kind_->text.point, has_plus_);
  std::size_t at = static_cast<std::size_t>(place.data() - frame_.data()), length = place.size();
  const bool is_aligned = !is_column || (at > 0 && frame_[at - 1] == ' ');
  const std::size_t kept = kind_->text.separators.find(' ') != std::string::npos ? 1 : 0;  // blanks
  while (is_column && text.size() > length && at > kept && frame_[at - 1] == ' ' && frame_[at - 1 - kept] == ' ')
    --at, ++length;
  if (is_aligned && text.size() < length) text.insert(0, length - text.size(), ' ');
  if (text.size() != length && (!is_column || kind_->length.form == LengthRule::LengthType::kFixed)) return false;
  const auto begin = frame_.begin() + static_cast<std::ptrdiff_t>(at);
  frame_.insert(frame_.erase(begin, begin + static_cast<std::ptrdiff_t>(length)), text.begin(), text.end());
  return frame_.size() <= kind_->length.max;
}

bool FrameEditor::mark() {
  for (const BitsRule& rule : kind_->roles.corrected) {
    const Field& field = kind_->fields[static_cast<std::size_t>(rule.field)];
    if (!view_.present(rule.field)) return false;
    store_bits(field, frame_.data() + (view_.find(field) - frame_.data()),
               (view_.bits(rule.field) & ~rule.mask) | rule.value);
  }
  return !kind_->roles.corrected.empty();
}

std::span<const std::uint8_t> FrameEditor::finish() {
  store_checks(*kind_, frame_, lower_case_);
  return frame_;
}

}  // namespace prism::wire
