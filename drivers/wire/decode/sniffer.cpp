// SPDX-License-Identifier: MIT
// Scores descriptions on a stream.
#include "drivers/wire/decode/sniffer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace prism::wire {
namespace {

constexpr std::uint64_t kLeastFrames = 3;
constexpr double kLeastShare = 0.5;

}  // namespace

Sniffer::Sniffer(const std::vector<FrameDescriptionPtr>& descriptions) {
  for (const FrameDescriptionPtr& description : descriptions) decoders_.emplace_back(description);
  rates_.resize(decoders_.size());
}

void Sniffer::feed(std::span<const std::uint8_t> bytes, std::int64_t arrival_ns) {
  if (bytes_ == 0) first_ns_ = arrival_ns;
  last_ns_ = arrival_ns;
  bytes_ += bytes.size();
  for (std::size_t i = 0; i < decoders_.size(); ++i) {
    readings_.clear();
    decoders_[i].feed(bytes, arrival_ns, readings_);
    const bool gyro =
        decoders_[i].description().carries_gyro();  // an instrument without a gyro counts with its sensors
    rates_[i] += static_cast<std::uint64_t>(std::count_if(
        readings_.begin(), readings_.end(), [&](const DecodedMessage& reading) { return reading.has_gyro || !gyro; }));
  }
}

std::vector<SniffScore> Sniffer::ranking() const {
  std::vector<SniffScore> scores;
  for (std::size_t i = 0; i < decoders_.size(); ++i) {
    const FrameDecoder& decoder = decoders_[i];
    const DecoderCounters& counters = decoder.counters();
    SniffScore& score = scores.emplace_back();
    score.description = decoder.description_ptr();
    score.frames = counters.frames;
    score.rates = rates_[i];
    score.bytes = counters.bytes;
    score.single = counters.unconfirmed;
    score.framed_bytes = counters.bytes - counters.skipped_bytes - decoder.held_bytes();
    const double seconds = 1e-9 * static_cast<double>(last_ns_ - first_ns_);
    score.rate_hz = seconds > 0 ? static_cast<double>(counters.frames) / seconds : 0;
    const bool explained = score.rates > 0 && score.share() >= kLeastShare;
    score.fits = explained && score.frames >= kLeastFrames;
    score.too_few = explained && !score.fits;
  }
  const auto rank = [](const SniffScore& s) {
    return std::tuple(s.fits, s.too_few, s.share(), s.frames, s.has_gaps());
  };
  std::stable_sort(scores.begin(), scores.end(),
                   [&](const SniffScore& a, const SniffScore& b) { return rank(a) > rank(b); });
  return scores;
}

std::string single_frames_text(std::uint64_t count) {
  return fmt::format("{} single frames fit, never two in a row; describe the messages between them", count);
}

std::string sniff_line(const SniffScore& score) {
  std::string line = fmt::format("{:<18} {:<5} {} frames, {:.1f} % of {} bytes", score.description->name,
                                 score.fits ? "fits" : "-", score.frames, 100 * score.share(), score.bytes);
  if (score.frames > 0 && score.rate_hz > 0) line += fmt::format(", {:.4g} Hz", score.rate_hz);
  if (score.too_few) line += fmt::format(": too few, at least {} are needed", kLeastFrames);
  if (score.has_gaps()) line += ": " + single_frames_text(score.single);
  if (score.frames > 0 && score.rates == 0) line += ": none with a rate";
  return line;
}

}  // namespace prism::wire
