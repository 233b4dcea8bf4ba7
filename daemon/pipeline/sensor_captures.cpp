// SPDX-License-Identifier: MIT
#include "daemon/pipeline/sensor_captures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace prism::pipeline {

namespace fs = std::filesystem;

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
    stream.bare.bytes_per_second = std::max(line.frames->rate_hz * line.frames->max_frame_bytes, 1.0);
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
      if (stream.head) return stream.pass.take(*stream.head), Result<void>();
      for (const std::string& damage : {stream.reader->damaged_places().text(), stream.reader->tail_damage()}) {
        if (!damage.empty()) notes_.push_back(damage);
      }
      stream.reader.reset();
    }
    if (stream.files.empty()) return {};
    Result<drivers::CaptureReader> next = drivers::CaptureReader::open(stream.files.front(), stream.bare);
    if (!next) return tl::unexpected<Error>(next.error());
    stream.files.pop_front();
    stream.reader.emplace(std::move(*next));
  }
}

void SensorCaptures::until(const drivers::CapturePacket& gyro, const Give& give) {
  gyro_.take(gyro);
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

}  // namespace prism::pipeline
