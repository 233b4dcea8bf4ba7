// SPDX-License-Identifier: MIT
#include "daemon/pipeline/corrected_frames.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "compensation/compensated.hpp"
#include "drivers/wire/description/check.hpp"

namespace prism::pipeline {
namespace {

void append(std::vector<std::uint8_t>& out, std::span<const std::uint8_t> bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace

void append_message(const Rows::Sample& sample, std::uint32_t number, double correction_deg_per_h, Form form,
                    std::vector<std::uint8_t>& out) {
  static const wire::Crc crc({32, 0x04C11DB7, 0xFFFFFFFF, true, true, 0xFFFFFFFF});
  constexpr std::uint64_t kSync = 0x5250, kVersion = 1;  // "PR"
  const std::uint32_t mark = form == Form::kCorrected ? 0 : 0x8000U << static_cast<unsigned>(form);
  const compensation::Compensated& row = sample.row;
  const std::size_t begin = out.size();
  const auto put = [&](std::uint64_t value, std::size_t size) { wire::append_number(out, value, size, false); };
  put(kSync, 2);
  put(kVersion, 1);
  put(sample.axis, 1);
  put(number, 4);
  put(static_cast<std::uint64_t>(row.sample.time_ns), 8);
  put(std::bit_cast<std::uint64_t>(row.sample.rate_deg_per_h), 8);
  put(std::bit_cast<std::uint64_t>(correction_deg_per_h), 8);
  put(std::bit_cast<std::uint32_t>(static_cast<float>(row.correction.sd_deg_per_h)), 4);
  put(row.correction.quality | mark, 4);
  put(crc.compute(std::span(out).subspan(begin)), 4);
}

CorrectedFrames::CorrectedFrames(const Setup& setup, std::size_t index)
    : config_(setup.outputs[index].config),
      is_first_(index == 0),
      same_(config_.frames == "same"),
      in_(setup.frames),
      editor_(setup.frames),
      axes_(setup.axes.size()) {
  const wire::FrameDescriptionPtr& frames = setup.outputs[index].frames;
  if (!frames) return;
  encoder_.emplace(frames);
  for (const wire::Channel& rule : frames->sensors())  // load_setup checked that the stream has them
    sensors_.push_back(sensor_index(sensors_of_list(setup.sensors), rule.sensor.name));
}

void CorrectedFrames::correction_changed() {
  for (AxisState& axis : axes_) axis.fading = axis.source.has_value();
}

const std::vector<std::uint8_t>& CorrectedFrames::push(std::span<const std::uint8_t> bytes, Rows& rows,
                                                       const wire::FrameDecoder& decoder) {
  out_.clear();
  append(waiting_, bytes);
  const std::uint64_t begin = decoder.counters().bytes - waiting_.size();
  std::size_t left = 0;  // of those that wait
  const auto take = [&](std::uint64_t end) {
    const std::size_t from = std::exchange(left, end - begin);
    return std::span<const std::uint8_t>(waiting_).subspan(from, left - from);
  };
  const auto pass = [&](std::uint64_t end) {
    const auto between = take(end);
    if (same_) append(out_, between);
  };
  std::size_t closed = 0;
  const auto close_seconds = [&](std::size_t samples_before) {
    for (; closed < rows.windows.size() && rows.windows[closed].samples_before <= samples_before; ++closed) {
      AxisState& axis = axes_[rows.windows[closed].axis];
      if (is_first_ && axis.weight > 0) rows.windows[closed].row.sent_deg_per_h = axis.sum / axis.weight;
      axis.sum = axis.weight = 0;
    }
  };
  for (const Rows::Frame& frame : rows.frames) {
    close_seconds(frame.first_sample);
    pass(frame.message.offset);
    const Form form = send(std::span(rows.samples).subspan(frame.first_sample, frame.sample_count), frame.message,
                           take(frame.message.offset + frame.message.length));
    ++counters_.by_form[static_cast<std::size_t>(form)];
    counters_.frames += form != Form::kDropped;
  }
  close_seconds(rows.samples.size());
  pass(decoder.decided());
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(left));
  return out_;
}

Form CorrectedFrames::send(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message,
                           std::span<const std::uint8_t> bytes) {
  for (AxisState& axis : axes_) {
    axis.sample = nullptr;
    axis.form = Form::kRaw;
    axis.sent = kUnknown;
  }
  Form form = samples.empty() && (!same_ || config_.then_drop) ? Form::kDropped : Form::kCorrected;
  for (const Rows::Sample& sample : samples) form = std::max(form, follow(axes_[sample.axis], sample.row));
  if (same_ && form != Form::kDropped) form = std::max(form, edit(message, bytes));
  if (form == Form::kDropped) return form;
  if (encoder_ && !encode(samples, message)) return Form::kDropped;
  for (const Rows::Sample& sample : samples) {
    AxisState& axis = axes_[sample.axis];
    if (!same_ && !encoder_)
      append_message(sample, number_++, axis.form == Form::kRaw ? 0 : axis.correction, axis.form, out_);
    if (axis.sample == nullptr) continue;
    axis.sum += axis.sent * axis.sample->interval_s;
    axis.weight += axis.sample->interval_s;
  }
  return form;
}

// The correction that is sent with this sample. A frame whose rate the device marks as invalid leaves as received; the
// correction does not change.
Form CorrectedFrames::follow(AxisState& axis, const compensation::Compensated& row) {
  const Sample& measured = row.sample;
  if (std::isnan(measured.rate_deg_per_h)) return axis.form;
  double target = 0;
  Form form = Form::kRaw;
  if (std::isfinite(row.corrected_deg_per_h)) {
    form = Form::kCorrected;
    target = axis.known = row.correction.sum_deg_per_h();
    axis.known_ns = measured.time_ns;
  } else {
    const double age_s = static_cast<double>(measured.time_ns - axis.known_ns) / 1e9;
    if (config_.hold_s > 0 && !std::isnan(axis.known) && age_s >= 0 && age_s <= config_.hold_s) {
      form = Form::kHeld;
      target = axis.known;
    } else if (config_.then_drop) {
      return axis.form = Form::kDropped;
    }
  }
  const bool of_fallback = form == Form::kCorrected && (row.correction.quality & compensation::kFallback) != 0;
  const std::pair source(form, of_fallback);
  axis.fading = axis.fading || (axis.source && *axis.source != source);
  axis.source = source;
  const double most = axis.fading ? config_.fade_deg_per_h_per_s * measured.interval_s : INFINITY;
  axis.correction += std::clamp(target - axis.correction, -most, most);
  if (axis.correction == target) axis.fading = false;
  axis.sample = &measured;
  axis.sent = measured.rate_deg_per_h - axis.correction;
  return axis.form = axis.fading ? Form::kFading : form;
}

Form CorrectedFrames::edit(const wire::DecodedMessage& message, std::span<const std::uint8_t> bytes) {
  editor_.begin(message.kind, bytes);
  Form form = Form::kCorrected;
  for (std::size_t i = 0; i < axes_.size() && form != Form::kDropped; ++i) {
    if (message.gyro[i].carried) form = std::max(form, edit_axis(i, message.gyro[i].value));
  }
  if (form == Form::kDropped) return form;
  if (form == Form::kCorrected) editor_.mark();
  append(out_, editor_.finish());
  return form;
}

Form CorrectedFrames::edit_axis(std::size_t index, double value) {
  AxisState& axis = axes_[index];
  const wire::RateEncoding meaning = in_->gyro.meaning;
  const bool accumulates = meaning == wire::RateEncoding::kAccumulated;
  if (std::isnan(value) || (axis.sample == nullptr && !accumulates)) return axis.form;
  double unit = in_->axes[index].scale;  // of `value`, deg/h
  if (axis.sample != nullptr && meaning != wire::RateEncoding::kRate) unit /= axis.sample->interval_s;
  double off = axis.sample != nullptr ? axis.correction / unit : 0;
  if (accumulates) off = axis.angle += off;  // the sum stays subtracted, so that a raw frame has no step
  if (off == 0) {
    axis.carry = 0;
    return axis.form;
  }
  const double wanted = value - off + axis.carry, found = editor_.put(index, wanted);
  if (std::isnan(found)) {
    ++counters_.unfit;
    if (axis.sample != nullptr) axis.sent = axis.sample->rate_deg_per_h;
    return axis.form = config_.then_drop ? Form::kDropped : Form::kRaw;
  }
  if (accumulates) return axis.form;
  axis.carry = wanted - found;
  axis.sent = axis.sample->rate_deg_per_h - (value - found) * unit;
  return axis.form;
}

bool CorrectedFrames::encode(std::span<const Rows::Sample> samples, const wire::DecodedMessage& message) {
  const Sample& first = samples.front().row.sample;
  wire::GyroState state{.interval_s = first.interval_s,
                        .temperature_degc = first.temperature_degc,
                        .uhfo_v = first.uhfo_v,
                        .status = message.status};
  state.valid.fill(false);
  for (const Rows::Sample& sample : samples) {
    const AxisState& axis = axes_[sample.axis];
    state.valid[sample.axis] = axis.sample != nullptr;
    if (axis.sample != nullptr) state.rate_deg_per_h[sample.axis] = axis.sent;
  }
  for (std::size_t i = 0; i < sensors_.size(); ++i) state.sensors[i] = message.sensors[sensors_[i]];
  if (!encoder_->can_state(state)) return false;
  if (first.missing_frames > 0) encoder_->skip(state, first.missing_frames);
  encoder_->encode(state, out_);
  return true;
}

}  // namespace prism::pipeline
