// SPDX-License-Identifier: MIT
// Reads a capture as a recording, through the same pipeline as prismd.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "base/sha256.hpp"
#include "config/config.hpp"
#include "daemon/pipeline/captures.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/pipeline/stream_watch.hpp"
#include "drivers/capture_file.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::recordings {

// Index of the wanted axis in the frame description.
Result<std::size_t> axis_index(const pipeline::Setup& setup, const std::string& wanted) {
  std::vector<std::string> names;
  for (const wire::AxisRule& axis : setup.frames->axes) {
    if (axis.name == wanted || (wanted.empty() && setup.axes.size() == 1)) return names.size();
    names.push_back(axis.name);
  }
  if (wanted.empty())
    return make_error(setup.config.path,
                      fmt::format("found axes {}, expected one; choose it with --axis", fmt::join(names, ", ")));
  return make_error("--axis", fmt::format("found \"{}\", expected one of {} in {}", wanted, fmt::join(names, ", "),
                                          setup.config.path));
}

Result<std::vector<std::string>> axes_of_capture(const SourceOptions& options) {
  if (options.config.empty()) return std::vector<std::string>();
  const auto config = config::load_config(options.config);
  if (!config) return tl::unexpected<Error>(config.error());
  std::vector<std::string> names;
  for (const config::AxisConfig& axis : config->axes) names.push_back(axis.name);
  return names;
}

Result<Recording> read_capture(const std::string& path, const SourceOptions& options, LeaveOut leave_out,
                               const SecondConsumer& consumer) {
  pipeline::Overrides overrides;
  overrides.without_models = true;
  auto setup = pipeline::load_setup(options.config, overrides);
  if (!setup) return tl::unexpected<Error>(setup.error());
  auto reader = pipeline::open_capture(path, *setup->frames);
  if (!reader) return tl::unexpected<Error>(reader.error());
  if (auto used = pipeline::use_time_of(*reader, path, *setup); !used) return tl::unexpected<Error>(used.error());
  const auto axis = axis_index(*setup, options.axis);
  if (!axis) return tl::unexpected<Error>(axis.error());
  Recording recording;
  recording.name = std::filesystem::path(path).stem().string();
  recording.add_metadata(pipeline::log_metadata(*setup, *axis));
  add_remarks(recording.findings, "configuration", setup->config.removed_keys);
  add_remarks(recording.findings, "configuration", setup->config.warnings);
  pipeline::Pipeline pipeline(*setup);
  std::optional<std::int64_t> session_ns;
  SecondFeed feed(recording, leave_out, true, consumer);
  Result<void> fed;
  const auto add = [&](const pipeline::Rows& rows) {
    for (const auto& window : rows.windows) {
      if (window.axis != *axis || !fed) continue;
      const bool begins = session_ns != window.session_ns;
      session_ns = window.session_ns;
      fed = feed.push(window.row.window.second_mean, begins);
    }
  };
  auto sensors = pipeline::SensorCaptures::open(*setup, pipeline::sensor_files_beside(*setup, path));
  if (!sensors) return tl::unexpected<Error>(sensors.error());
  const auto feed_sensor = [&](std::size_t line, const drivers::CapturePacket& packet) {
    if (packet.event == drivers::CaptureEvent::kOpened) pipeline.begin_sensor_session(line, packet.time_ns);
    if (packet.event == drivers::CaptureEvent::kData) pipeline.feed_sensors(line, packet.bytes, packet.time_ns);
  };
  std::size_t packets = 0;
  for (; const auto packet = reader->next(); ++packets) {
    sensors->until(*packet, feed_sensor);
    if (packet->event == drivers::CaptureEvent::kOpened) add(pipeline.begin_session(packet->time_ns));
    if (packet->event == drivers::CaptureEvent::kData) add(pipeline.feed(packet->bytes, packet->time_ns));
    if (!fed) return tl::unexpected<Error>(fed.error());
  }
  add(pipeline.finish());
  if (!fed) return tl::unexpected<Error>(fed.error());
  const std::string clocks = pipeline::clocks_text(*setup->frames, pipeline.clock().rate_check());
  if (!clocks.empty())
    return make_error(path, clocks + "; correct rate_hz, or accept it with \"accept_clock\" in the configuration");
  if (recording.seconds == 0 && options.leave_out.empty())
    return make_error(path, "found no frame of " + setup->config.frames);
  if (auto done = feed.finish(); !done) return tl::unexpected<Error>(done.error());
  add_remarks(recording.findings, "file", sensors->notes());
  add_remarks(recording.findings, "file", {reader->damaged_places().text(), reader->tail_damage()});
  const auto sum = sha256_of_file(path);
  if (!sum) return tl::unexpected<Error>(sum.error());
  recording.files.push_back({path, *sum, packets});
  return recording;
}

}  // namespace prism::recordings
