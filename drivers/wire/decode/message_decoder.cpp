// SPDX-License-Identifier: MIT
// Reads the roles of a frame's fields and holds slow channels.
#include "drivers/wire/decode/message_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace prism::wire {
namespace {

/// True if every frame of a message type contains the same sensors: then some frames can be skipped.
bool tells_alike(const MessageType& kind) {
  const auto always = [&](const ChannelFields& fields) {
    return fields.high < 0 && fields.low < 0 && std::all_of(fields.whole.begin(), fields.whole.end(), [&](int field) {
             return kind.fields[static_cast<std::size_t>(field)].when.field < 0;
           });
  };
  return kind.structure == Structure::kPlain &&
         std::all_of(kind.roles.channels.begin() + kRoleChannels, kind.roles.channels.end(), always);
}

}  // namespace

std::uint32_t sensor_stride(double frames_hz) {
  constexpr double kReadHz = 100;
  return static_cast<std::uint32_t>(std::max(1.0, std::floor(frames_hz / kReadHz)));
}

SlowValue::SlowValue(const Channel& channel, double rate_hz)
    : channel_(&channel), limit_frames_(static_cast<std::uint64_t>(std::ceil(channel.stale_after_s * rate_hz))) {}

void SlowValue::reset() {
  value_ = kUnknown;
  age_frames_ = 0;
  out_of_bounds_ = false;
  high_.reset();
}

void SlowValue::set(double value, bool out_of_bounds) {
  value_ = value;
  out_of_bounds_ = out_of_bounds;
  age_frames_ = 0;
}

void SlowValue::take_halves(const FrameView& view, int high, int low, bool adjacent) {
  const bool has_high = high >= 0 && view.present(high);
  if (low >= 0 && view.present(low) && high_ && adjacent) {
    const auto unused = static_cast<unsigned>(64 - channel_->bits);
    const std::uint64_t joined = (*high_ << channel_->low_bits | view.bits(low)) << unused;
    const double raw = channel_->is_signed ? static_cast<double>(static_cast<std::int64_t>(joined) >> unused)
                                           : static_cast<double>(joined >> unused);
    const double value = channel_->joined.apply(raw);
    out_of_range_ = !(std::isfinite(value) && channel_->joined.admits(value));
    set(out_of_range_ ? kUnknown : value, out_of_range_);
  }
  high_.reset();
  if (has_high) high_ = view.bits(high);
}

void SlowValue::push(const FrameView& view, const ChannelFields& fields, std::uint64_t steps, bool adjacent) {
  out_of_range_ = false;
  age_frames_ += steps;
  for (const int field : fields.whole) {
    const double raw = view.raw(field);
    if (std::isnan(raw) && !view.present(field)) continue;
    const double value = view.scaled(field, raw);
    out_of_range_ = std::isnan(value);
    return set(value, out_of_range_ && !std::isnan(raw));
  }
  if (fields.high >= 0 || fields.low >= 0 || high_) take_halves(view, fields.high, fields.low, adjacent);
}

MessageDecoder::MessageDecoder(FrameDescriptionPtr description) : description_(std::move(description)) {
  for (const Channel& channel : description_->channels)
    channels_.emplace_back(channel, description_->counted_rate_hz());
  for (std::size_t i = 0; i < kRoleChannels; ++i) has_role_[i] = description_->channels[i].present;
  if (std::all_of(description_->kinds.begin(), description_->kinds.end(), tells_alike))
    stride_ = sensor_stride(description_->counted_rate_hz());
  waiting_.assign(description_->kinds.size(), 0);
  for (const MessageType& kind : description_->kinds) tells_.push_back(kind.roles.tells_anything());
}

void MessageDecoder::reset() {
  for (SlowValue& channel : channels_) channel.reset();
  std::fill(waiting_.begin(), waiting_.end(), 0);
  untold_steps_ = 0;
  last_counter_.reset();
}

void MessageDecoder::read_counter(const MessageFields& roles, const FrameView& view, bool contiguous,
                                  DecodedMessage& reading) {
  for (const int field : roles.counter) {
    const std::uint64_t counter = view.count(field);  // 0: perhaps not a number, then the counter check rejects it
    if (counter == 0 && !view.present(field)) continue;
    reading.counter = counter;
    reading.has_counter = true;
    break;
  }
  steps_ = 1;
  adjacent_ = contiguous;
  if (!reading.has_counter) return;
  const CounterRule& rule = *description_->counter;
  if (rule.modulus != 0 && reading.counter >= rule.modulus) reading.counter %= rule.modulus;
  if (last_counter_) {
    const std::uint64_t ticks = rule.ticks_between(*last_counter_, reading.counter);
    if (static_cast<double>(ticks) != rule.ticks_per_frame) {
      const double steps = std::nearbyint(static_cast<double>(ticks) / rule.ticks_per_frame);
      steps_ = static_cast<std::uint64_t>(std::clamp(steps, 1.0, 0x1p63));  // a counter of 64 bits that goes back
    }
    if (!rule.step_varies && steps_ != 1) adjacent_ = false;
  }
  last_counter_ = reading.counter;
}

void MessageDecoder::keep_unread(const FrameView& view) {
  constexpr std::size_t kShown = 60;
  if (!unread_text_.empty() || !view.is_text()) return;
  for (const std::uint8_t byte : view.frame().first(std::min(kShown, view.frame().size()))) {
    if (byte >= ' ' && byte < 0x7F) unread_text_ += static_cast<char>(byte);
  }
}

void MessageDecoder::read_axis(const AxisRoles& roles, const FrameView& view, AxisReading& reading) {
  reading.carried = !roles.gyro.empty();
  for (const int field : roles.gyro) {
    const double raw = view.raw(field);
    if (std::isnan(raw) && !view.present(field)) continue;
    const double value = view.scaled(field, raw);
    if (std::isnan(value)) {
      ++out_of_range_;
      if (std::isnan(raw)) keep_unread(view);
      reading.out_of_bounds = !std::isnan(raw);
    }
    bool valid = !std::isnan(value);
    for (const BitsRule& rule : roles.valid) valid = valid && (view.bits(rule.field) & rule.mask) == rule.value;
    reading.valid = valid;
    reading.value = value;
    return;
  }
  if (reading.carried) keep_unread(view);
}

bool MessageDecoder::sensors_turn(std::int32_t kind) {
  untold_steps_ += steps_;
  std::uint32_t& waiting = waiting_[static_cast<std::size_t>(kind)];
  if (waiting > 0) {
    --waiting;
    return false;
  }
  waiting = stride_ - 1;
  return true;
}

void MessageDecoder::read_sensors(const MessageFields& roles, const FrameView& view, DecodedMessage& reading) {
  reading.sensors_read = sensors_turn(reading.kind);
  if (reading.sensors_read) {
    const std::uint64_t steps = std::exchange(untold_steps_, 0);
    for (std::size_t i = kRoleChannels; i < channels_.size(); ++i) {
      channels_[i].push(view, roles.channels[i], steps, adjacent_);
      held_[i - kRoleChannels] = channels_[i].value();
      out_of_range_ += channels_[i].out_of_range() ? 1 : 0;
    }
  }
  std::copy_n(held_.begin(), channels_.size() - kRoleChannels, reading.sensors.begin());
}

bool MessageDecoder::make(std::int32_t kind, const FrameView& view, bool contiguous, DecodedMessage& reading) {
  if (tells_[static_cast<std::size_t>(kind)] == 0) return false;
  const MessageFields& roles = description_->kinds[static_cast<std::size_t>(kind)].roles;
  reading.kind = kind;
  read_counter(roles, view, contiguous, reading);
  for (std::size_t i = 0; i < roles.axes.size(); ++i) {
    read_axis(roles.axes[i], view, reading.gyro[i]);
    reading.has_gyro = reading.has_gyro || reading.gyro[i].carried;
  }
  for (const int field : roles.status) {
    const std::uint64_t status = view.bits(field);
    if (status != 0 || view.present(field)) reading.status = static_cast<std::uint32_t>(status);
  }
  reading.latency_s = description_->latency_s;
  for (const int field : roles.latency) {
    if (const double latency = view.value(field); !std::isnan(latency)) reading.latency_s += latency;
  }
  const auto read_role = [&](ChannelRole role, double& value, bool& out_of_bounds) {  // in each frame
    const auto i = static_cast<std::size_t>(role);
    if (!has_role_[i]) return;
    SlowValue& channel = channels_[i];
    channel.push(view, roles.channels[i], steps_, adjacent_);
    value = channel.value();
    out_of_bounds = channel.out_of_bounds();
    out_of_range_ += channel.out_of_range() ? 1 : 0;
  };
  read_role(ChannelRole::kTemperature, reading.temperature_degc, reading.out_of_bounds.temperature);
  read_role(ChannelRole::kUhfo, reading.uhfo_v, reading.out_of_bounds.uhfo);
  if (channels_.size() > kRoleChannels) read_sensors(roles, view, reading);
  return true;
}

}  // namespace prism::wire
