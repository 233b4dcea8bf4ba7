// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "base/file.hpp"
#include "config/search_path.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands/commands.hpp"
#include "tools/prismcal/commands/recording_options.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::commands {
namespace {

struct ConvertChoice {
  std::string recording, frames = "second-means", out;
  recordings::SourceOptions source;
  bool quiet = false;
};

Result<wire::FrameDescriptionPtr> one_per_second(const std::string& frames) {
  const std::string path = config::find_data_file(frames, "frames", ".");
  const auto text = config::read_data_file(path, "frames", "--frames");
  if (!text) return tl::unexpected(text.error());
  auto description = wire::parse_frame_description(*text, path);
  if (description && !(*description)->carries_gyro()) return make_error(path, "found no gyro, expected one");
  if (description && (*description)->rate_hz != 1) {
    return make_error(path, fmt::format("found {} frames per second, expected 1", (*description)->rate_hz));
  }
  return description;
}

/// Writes one frame per row, at second + 0.95 s, so that clock rounding does not move it to the next second. The
/// counter skips missing seconds. Partial seconds are omitted, since a frame covers a full second. Sessions begin as in
/// the recording.
Result<std::size_t> write_capture(const recordings::Recording& recording, wire::FrameDescriptionPtr frames,
                                  const std::string& out) {
  auto writer = drivers::CaptureWriter::open(out);
  if (!writer) return tl::unexpected(writer.error());
  wire::FrameEncoder encoder(std::move(frames));
  std::vector<std::uint8_t> bytes;
  std::int64_t next = recording.second_means.empty() ? 0 : recording.second_means.front().second;
  std::size_t session = 0, index = 0, frames_written = 0;
  for (const compensation::SecondMean& second_mean : recording.second_means) {
    const std::int64_t time_ns = second_mean.second * compensation::kNanosecondsPerSecond + 950'000'000;
    if (session < recording.sessions.size() && recording.sessions[session] == index++) {
      if (++session > 1) {
        next = second_mean.second;
        if (const auto done = writer->opened(time_ns); !done) return tl::unexpected(done.error());
      }
    }
    if (second_mean.partial) continue;
    wire::GyroState state;
    state.interval_s = 1;
    state.valid[0] = std::isfinite(second_mean.rate_deg_per_h);
    state.rate_deg_per_h[0] = state.valid[0] ? second_mean.rate_deg_per_h : 0;
    state.temperature_degc = second_mean.temperature_degc;
    state.uhfo_v = second_mean.uhfo_v;
    if (second_mean.second > next) encoder.skip(state, static_cast<std::uint64_t>(second_mean.second - next));
    next = second_mean.second + 1;
    bytes.clear();
    encoder.encode(state, bytes);
    const auto done = writer->data(time_ns, bytes);
    if (!done) return tl::unexpected(done.error());
    ++frames_written;
  }
  const auto flushed = writer->flush();
  if (!flushed) return tl::unexpected(flushed.error());
  return frames_written;
}

Result<std::size_t> convert(const ConvertChoice& choice) {
  const auto frames = one_per_second(choice.frames);
  if (!frames) return tl::unexpected(frames.error());
  recordings::SourceOptions source = choice.source;
  if (choice.quiet) source.table.announce = {};
  source.judged = false;  // prismd judges the frames
  const auto recording = recordings::read_recording(choice.recording, source);
  if (!recording) return tl::unexpected(recording.error());
  if (recording->second_means.empty()) return make_error(choice.recording, "found no row");
  return write_capture(*recording, *frames, choice.out);
}

}  // namespace

void add_convert_command(CLI::App& app, int& code) {
  CLI::App* command =
      app.add_subcommand("convert", "convert a recording to a capture with one frame per second, for prismd --replay");
  const auto choice = std::make_shared<ConvertChoice>();
  command->add_option("recording", choice->recording, "prismd's log (file or folder), a capture, or CSV with --map")
      ->required();
  command->add_option("--out", choice->out, "capture to write")->required();
  command->add_option("--frames", choice->frames, "frame description with one frame per second, by name or path")
      ->capture_default_str();
  add_source_options(*command, choice->source);
  command->add_flag("--quiet", choice->quiet, "no remarks on stderr");
  tools::add_examples(*command, {"prismcal convert logs/ --out record.pcap"});
  command->callback([choice, &code] {
    const auto frames = convert(*choice);
    if (frames) fmt::print("{}: {} frames\n", choice->out, *frames);
    code = frames ? 0 : failed(frames.error());
  });
}

}  // namespace prism::commands
