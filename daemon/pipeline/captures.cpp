// SPDX-License-Identifier: MIT
#include "daemon/pipeline/captures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/escape.hpp"
#include "base/text_number.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"

namespace prism::pipeline {

namespace fs = std::filesystem;

namespace {

// The pace is that of the longest frames; no time of the gyro's follows from it.
double raw_bytes_per_s(const wire::FrameDescription& frames) {
  return std::max(frames.rate_hz * frames.max_frame_bytes, 1.0);
}

bool has_value(const wire::DecodedMessage& message, std::size_t sensors) {
  return std::any_of(message.sensors.begin(), message.sensors.begin() + static_cast<std::ptrdiff_t>(sensors),
                     [](double value) { return std::isfinite(value); });
}

Result<void> check_sensor_file(const Setup::SensorLine& line, const std::string& path) {
  constexpr std::size_t kFirstBytes = 60;
  auto reader = drivers::CaptureReader::open(path, raw_bytes_per_s(*line.frames));
  if (!reader) return tl::unexpected<Error>(reader.error());
  wire::FrameDecoder decoder(line.frames);
  std::vector<wire::DecodedMessage> messages;
  std::string first;
  const auto found = [&] {
    return std::any_of(messages.begin(), messages.end(),
                       [&](const auto& message) { return has_value(message, line.frames->sensors().size()); });
  };
  while (const auto packet = reader->next()) {
    if (packet->event != drivers::CaptureEvent::kData) continue;
    if (first.size() < kFirstBytes) first.append(packet->bytes.begin(), packet->bytes.end());
    messages.clear();
    decoder.feed(packet->bytes, packet->time_ns, messages);
    if (found()) return {};
  }
  messages.clear();
  decoder.finish(messages);
  if (first.empty() || found()) return {};
  std::vector<std::string> sensors;
  for (const wire::Channel& rule : line.frames->sensors()) sensors.push_back(rule.sensor.name);
  return make_error(
      path, fmt::format("found no value in {} bytes, the first line is \"{}\"; expected {} of the sensor "
                        "line {}, described by {} ({})",
                        decoder.counters().bytes, shortened(first.substr(0, first.find_first_of("\r\n")), kFirstBytes),
                        fmt::join(sensors, ", "), line.name, line.frames->name, line.frames->title));
}

}  // namespace

Result<drivers::CaptureReader> open_capture(const std::string& path, const wire::FrameDescription& frames) {
  return drivers::CaptureReader::open(path, raw_bytes_per_s(frames));
}

Result<void> use_time_of(const drivers::CaptureReader& reader, const std::string& path, Setup& setup) {
  if (!reader.is_bare()) return {};
  if (!setup.sensor_lines.empty())
    return make_error(path, "found raw bytes without arrival times, expected a capture (pcap): sensor lines need them");
  setup.clock.source = drivers::ClockSource::kDevice;
  setup.clock.arrivals_are_measured = false;
  return {};
}

Result<void> check_sensor_files(const Setup& setup, const SensorFiles& files) {
  for (const Setup::SensorLine& line : setup.sensor_lines) {
    const auto named = files.find(line.name);
    if (named == files.end()) continue;
    for (const std::string& path : named->second) {
      if (auto good = check_sensor_file(line, path); !good) return good;
    }
  }
  return {};
}

SensorFiles sensor_files_beside(const Setup& setup, const std::string& gyro_capture) {
  SensorFiles files;
  for (const Setup::SensorLine& line : setup.sensor_lines) {
    std::vector<std::string>& found = files[line.name];
    std::error_code error;
    for (fs::directory_iterator entry(fs::path(gyro_capture).parent_path() / line.name, error), end;
         !error && entry != end; entry.increment(error)) {
      if (entry->path().extension() == ".pcap") found.push_back(entry->path().string());
    }
    std::sort(found.begin(), found.end());
  }
  return files;
}

void SensorCaptures::Pass::take(const drivers::CapturePacket& packet) {
  if (packet.event == drivers::CaptureEvent::kOpened && packet.time_ns < last_ns) ++number;
  last_ns = packet.time_ns;
}

Result<SensorCaptures> SensorCaptures::open(const Setup& setup, const SensorFiles& files) {
  SensorCaptures captures;
  for (std::size_t i = 0; i < setup.sensor_lines.size(); ++i) {
    const Setup::SensorLine& line = setup.sensor_lines[i];
    const auto found = files.find(line.name);
    if (found == files.end() || found->second.empty()) {
      captures.notes_.push_back(
          fmt::format("{}: found no capture of this sensor line; its values are unknown", line.name));
      continue;
    }
    Stream& stream = captures.streams_.emplace_back();
    stream.line = i;
    stream.name = line.name;
    stream.raw_bytes_per_s = raw_bytes_per_s(*line.frames);
    stream.files.assign(found->second.begin(), found->second.end());
    if (auto opened = captures.advance(stream); !opened) return tl::unexpected<Error>(opened.error());
  }
  for (const auto& [name, paths] : files) {
    const bool known = std::any_of(setup.sensor_lines.begin(), setup.sensor_lines.end(),
                                   [&, &wanted = name](const Setup::SensorLine& line) { return line.name == wanted; });
    if (!known)
      return make_error(setup.config.path,
                        fmt::format("found no sensor line \"{}\", which --replay-sensors names", name));
  }
  return captures;
}

Result<void> SensorCaptures::advance(Stream& stream) {
  for (;;) {
    if (stream.reader) {
      stream.head = stream.reader->next();
      if (stream.head) {
        stream.pass.take(*stream.head);
        stream.last_ns = stream.head->time_ns;
        if (stream.first_ns == 0) stream.first_ns = stream.last_ns;
        return {};
      }
      for (const std::string& damage : {stream.reader->damaged_places().text(), stream.reader->tail_damage()}) {
        if (!damage.empty()) notes_.push_back(damage);
      }
      stream.reader.reset();
    }
    if (stream.files.empty()) return {};
    Result<drivers::CaptureReader> next = drivers::CaptureReader::open(stream.files.front(), stream.raw_bytes_per_s);
    if (!next) return tl::unexpected<Error>(next.error());
    stream.files.pop_front();
    stream.reader.emplace(std::move(*next));
  }
}

void SensorCaptures::until(const drivers::CapturePacket& gyro, const Give& give) {
  gyro_.take(gyro);
  gyro_last_ns_ = gyro.time_ns;
  if (gyro_first_ns_ == 0) gyro_first_ns_ = gyro.time_ns;
  for (Stream& stream : streams_) {
    const auto due = [&] {
      return stream.head &&
             std::pair(stream.pass.number, stream.head->time_ns) <= std::pair(gyro_.number, gyro.time_ns);
    };
    while (due()) {
      give(stream.line, *stream.head);
      if (auto more = advance(stream); !more) {
        notes_.push_back(more.error().text());
        stream.files.clear();
        stream.head.reset();
      }
    }
  }
}

std::vector<std::string> SensorCaptures::notes() const {
  std::vector<std::string> notes = notes_;
  const auto range = [](std::int64_t first_ns, std::int64_t last_ns) {
    return utc_text(first_ns / 1'000'000'000) + " to " + utc_text(last_ns / 1'000'000'000);
  };
  for (const Stream& stream : streams_) {
    // After a step of the host clock, times do not compare.
    const bool in_order = gyro_.number == 0 && stream.pass.number == 0 && gyro_first_ns_ > 0 && stream.first_ns > 0;
    if (!in_order || (stream.first_ns <= gyro_last_ns_ && stream.last_ns >= gyro_first_ns_)) continue;
    notes.push_back(
        fmt::format("{}: its capture is from {}, the gyro's from {}: no common time, so its values are "
                    "unknown",
                    stream.name, range(stream.first_ns, stream.last_ns), range(gyro_first_ns_, gyro_last_ns_)));
  }
  return notes;
}

}  // namespace prism::pipeline
