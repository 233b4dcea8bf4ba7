// SPDX-License-Identifier: MIT
#include "daemon/pipeline/corrected_frames.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "compensation/compensated.hpp"
#include "drivers/wire/description/check.hpp"

namespace prism::pipeline {

namespace message {
void append(const Fields& fields, std::vector<std::uint8_t>& out) {
  static const wire::Crc crc({.width = 32,
                              .poly = 0x04C11DB7,
                              .init = 0xFFFFFFFF,
                              .reflect_in = true,
                              .reflect_out = true,
                              .xor_out = 0xFFFFFFFF});
  constexpr std::uint64_t kSync = 0x5250, kVersion = 1;  // "PR"
  const std::size_t begin = out.size();
  const auto put = [&](std::uint64_t value, std::size_t size) { wire::append_number(out, value, size, false); };
  put(kSync, 2);
  put(kVersion, 1);
  put(fields.axis, 1);
  put(fields.number, 4);
  put(static_cast<std::uint64_t>(fields.time_ns), 8);
  put(std::bit_cast<std::uint64_t>(fields.rate_deg_per_h), 8);
  put(std::bit_cast<std::uint64_t>(fields.correction_deg_per_h), 8);
  put(std::bit_cast<std::uint32_t>(fields.sd_deg_per_h), 4);
  put(fields.flags, 4);
  put(crc.compute(std::span(out).subspan(begin)), 4);
}

}  // namespace message

using config::WhenUnknown;

CorrectedFrames::CorrectedFrames(const Setup& setup, const Setup::Output& output)
    : config_(output.config), in_(setup.frames), editor_(setup.frames), axes_(setup.axes.size()) {
  if (!output.frames) return;
  encoder_.emplace(output.frames);
  const std::vector<SensorName>& there = sensors_of_list(setup.sensors);
  for (const wire::SensorRule& rule : output.frames->sensors) {
    const auto same = std::find_if(there.begin(), there.end(),
                                   [&](const SensorName& sensor) { return sensor.name == rule.sensor.name; });
    sensors_.push_back(static_cast<std::size_t>(same - there.begin()));  // load_setup checked it
  }
}

void CorrectedFrames::model_changed() {
  for (AxisState& axis : axes_) axis.fading = axis.source != Source::kNone;
}

void CorrectedFrames::push(std::span<const std::uint8_t> bytes, const Rows& rows, const wire::FrameDecoder& decoder,
                           std::vector<std::uint8_t>& out) {
  const bool same = config_.frames == "same";
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  const std::uint64_t begin = decoder.counters().bytes - waiting_.size();
  means_.clear();
  std::size_t at = 0;  // in waiting_: everything before it has left
  for (const Rows::Frame& frame : rows.frames) {
    if (frame.sample_count > 0) close_seconds(rows, frame.first_sample);
    const std::size_t first = frame.message.offset - begin, length = frame.message.length;
    if (same)
      out.insert(out.end(), waiting_.begin() + static_cast<std::ptrdiff_t>(at),
                 waiting_.begin() + static_cast<std::ptrdiff_t>(first));
    at = first + length;
    const bool left = send(std::span(rows.samples).subspan(frame.first_sample, frame.sample_count), frame.message,
                           std::span(waiting_).subspan(first, length), out);
    ++(left ? counters_.frames : counters_.dropped);
  }
  close_seconds(rows, rows.samples.size());
  const std::size_t end = decoder.decided() - begin;
  if (same)
    out.insert(out.end(), waiting_.begin() + static_cast<std::ptrdiff_t>(at),
               waiting_.begin() + static_cast<std::ptrdiff_t>(end));
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(end));
}

// The windows that were closed before this sample.
void CorrectedFrames::close_seconds(const Rows& rows, std::size_t first_sample) {
  while (means_.size() < rows.windows.size() && rows.windows[means_.size()].samples_before <= first_sample) {
    AxisState& axis = axes_[rows.windows[means_.size()].axis];
    means_.push_back(axis.weight > 0 ? axis.sum / axis.weight : kUnknown);
    axis.sum = axis.weight = 0;
  }
}

// The correction that is sent with this sample. A frame whose rate the device marks as invalid leaves as received; the
// correction does not change.
CorrectedFrames::Verdict CorrectedFrames::follow(AxisState& axis, const Sample& measured,
                                                 const compensation::Compensated& row) {
  if (std::isnan(measured.rate_deg_per_h)) return {};
  double target = 0;
  Source source = Source::kRaw;
  if (std::isfinite(row.corrected_deg_per_h)) {
    target = row.correction.bias_deg_per_h;
    source = (row.correction.quality & compensation::kFallback) != 0 ? Source::kFallback : Source::kModel;
    axis.known_ns = measured.time_ns, axis.known = target;
  } else if (config_.when_unknown != WhenUnknown::kRaw) {
    const double age_s = axis.known_ns ? static_cast<double>(measured.time_ns - *axis.known_ns) / 1e9 : INFINITY;
    const bool holds = config_.when_unknown == WhenUnknown::kHold && age_s >= 0 && age_s <= config_.hold_s;
    if (!holds && (config_.when_unknown == WhenUnknown::kDrop || config_.then_drop)) return {.drop = true};
    if (holds) target = axis.known, source = Source::kHeld;
  }
  axis.fading = axis.fading || (axis.source != Source::kNone && source != axis.source);
  axis.source = source;
  const double most = axis.fading ? config_.fade_deg_per_h_per_s * measured.interval_s : INFINITY;
  axis.correction += std::clamp(target - axis.correction, -most, most);
  if (axis.correction == target) axis.fading = false;
  const Form form = axis.fading               ? Form::kFading
                    : source == Source::kHeld ? Form::kHeld
                    : source == Source::kRaw  ? Form::kRaw
                                              : Form::kCorrected;
  return {form, false, axis.correction, measured.rate_deg_per_h - axis.correction};
}

// Returns false if nothing left.
bool CorrectedFrames::send(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
                           std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out) {
  const bool same = config_.frames == "same";
  bool drop = samples.empty() && (!same || config_.when_unknown == WhenUnknown::kDrop);
  verdicts_.clear();
  for (const Rows::Sample& sample : samples) {
    verdicts_.push_back(follow(axes_[sample.axis], sample.row.sample, sample.row));
    drop = drop || verdicts_.back().drop;
  }
  if (drop || (same && !edit(samples, message, bytes, out))) return false;
  if (!same) encode(samples, message, out);
  count(samples);
  return true;
}

void CorrectedFrames::count(std::span<const Rows::Sample> samples) {
  Form worst = verdicts_.empty() ? Form::kRaw : Form::kCorrected;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    worst = std::max(worst, verdicts_[i].form);
    if (!std::isfinite(verdicts_[i].sent)) continue;
    AxisState& axis = axes_[samples[i].axis];
    axis.sum += verdicts_[i].sent * samples[i].row.sample.interval_s;
    axis.weight += samples[i].row.sample.interval_s;
  }
  static constexpr std::uint64_t OutputCounters::*kForms[] = {&OutputCounters::corrected, &OutputCounters::fading,
                                                              &OutputCounters::held, &OutputCounters::raw};
  ++(counters_.*kForms[static_cast<std::size_t>(worst)]);
}

bool CorrectedFrames::edit(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
                           std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out) {
  editor_.begin(message.kind, bytes);
  bool all = !samples.empty();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const wire::AxisReading& reading = message.gyro[i];
    if (!reading.carried) continue;
    const auto own = std::find_if(samples.begin(), samples.end(), [&](const auto& sample) { return sample.axis == i; });
    Verdict* const verdict =
        own == samples.end() ? nullptr : &verdicts_[static_cast<std::size_t>(own - samples.begin())];
    if (!edit_axis(i, reading, verdict != nullptr ? &own->row.sample : nullptr, verdict)) {
      ++counters_.unfit;
      if (config_.when_unknown == WhenUnknown::kDrop) return false;
    }
    all = all && verdict != nullptr && verdict->form == Form::kCorrected;
  }
  if (all) editor_.mark();
  const std::span<const std::uint8_t> frame = editor_.finish();
  out.insert(out.end(), frame.begin(), frame.end());
  return true;
}

// Returns false, with a raw verdict, if the field cannot have the number.
bool CorrectedFrames::edit_axis(std::size_t index, const wire::AxisReading& reading, const Sample* sample,
                                Verdict* verdict) {
  AxisState& axis = axes_[index];
  const double scale = in_->axes[index].scale;
  const wire::RateEncoding meaning = in_->gyro.meaning;
  const bool known = verdict != nullptr && std::isfinite(verdict->sent) && !std::isnan(reading.value);
  const bool accumulates = meaning == wire::RateEncoding::kAccumulated;
  if (std::isnan(reading.value) || (!known && !accumulates)) return true;
  double off = known ? verdict->correction / scale : 0;
  if (meaning != wire::RateEncoding::kRate && known) off *= sample->interval_s;
  if (accumulates) off = axis.angle += off;  // the sum stays subtracted, so that a raw frame has no step
  if (off == 0) {
    axis.carry = 0;
    return true;
  }
  const double wanted = reading.value - off + axis.carry, found = editor_.put(index, wanted);
  if (std::isnan(found)) {
    if (known) *verdict = {.sent = sample->rate_deg_per_h};
    return false;
  }
  if (accumulates) return true;
  axis.carry = wanted - found;
  const double taken = (reading.value - found) * scale;
  verdict->sent = sample->rate_deg_per_h - (meaning == wire::RateEncoding::kRate ? taken : taken / sample->interval_s);
  return true;
}

void CorrectedFrames::encode(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
                             std::vector<std::uint8_t>& out) {
  if (encoder_) {
    const Sample& first = samples.front().row.sample;
    wire::GyroState state{.interval_s = first.interval_s,
                          .temperature_degc = first.temperature_degc,
                          .uhfo_v = first.uhfo_v,
                          .status = message.status};
    for (std::size_t i = 0; i < sensors_.size(); ++i) state.sensors[i] = message.sensors[sensors_[i]];
    state.valid.fill(false);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      state.valid[samples[i].axis] = std::isfinite(verdicts_[i].sent);
      state.rate_deg_per_h[samples[i].axis] = state.valid[samples[i].axis] ? verdicts_[i].sent : 0;
    }
    if (first.missing_frames > 0) encoder_->skip(state, first.missing_frames);
    return encoder_->encode(state, out);
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const compensation::Compensated& row = samples[i].row;
    const Form form = verdicts_[i].form;
    std::uint32_t flags = row.correction.quality;
    if (form == Form::kFading) flags |= message::kFading;
    if (form == Form::kHeld) flags |= message::kHeld;
    if (form == Form::kRaw) flags |= message::kRaw;
    message::append({.axis = static_cast<std::uint8_t>(samples[i].axis),
                     .number = number_++,
                     .time_ns = row.sample.time_ns,
                     .rate_deg_per_h = row.sample.rate_deg_per_h,
                     .correction_deg_per_h = verdicts_[i].correction,
                     .sd_deg_per_h = static_cast<float>(row.correction.sd_deg_per_h),
                     .flags = flags},
                    out);
  }
}

}  // namespace prism::pipeline
