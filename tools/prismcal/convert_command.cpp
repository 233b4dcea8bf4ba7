// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "config/search_path.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/recording.hpp"

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
/// counter skips missing seconds. Partial seconds are omitted, since a frame covers a full second, and those with an
/// unknown value that the frame cannot mark. Sessions begin as in the recording.
Result<int> convert(const ConvertChoice& choice) {
  const auto frames = one_per_second(choice.frames);
  if (!frames) return tl::unexpected(frames.error());
  recordings::SourceOptions source = choice.source;
  if (choice.quiet) source.table.silence();
  source.judged = false;  // prismd judges the frames
  std::error_code error;
  if (std::filesystem::equivalent(choice.recording, choice.out, error))
    return make_error(choice.out, "is the recording itself, expected another file");
  wire::FrameEncoder encoder(*frames);
  wire::GyroState state{.interval_s = 1};  // of a frame
  std::optional<drivers::CaptureWriter> writer;
  std::vector<std::uint8_t> bytes;
  std::int64_t next = 0;  // the second after the last frame
  std::size_t count = 0;
  const auto push = [&](const recordings::Recording&, const compensation::SecondMean& second_mean,
                        bool begins_session) -> Result<void> {
    const std::int64_t time_ns = second_mean.second * compensation::kNanosecondsPerSecond + 950'000'000;
    if (!writer) {
      auto opened = drivers::CaptureWriter::open(choice.out);
      if (!opened) return tl::unexpected(opened.error());
      writer.emplace(std::move(*opened));
      next = second_mean.second;
    } else if (begins_session) {
      next = second_mean.second;
      if (auto done = writer->opened(time_ns); !done) return done;
    }
    if (second_mean.partial) return {};
    state.valid[0] = std::isfinite(second_mean.rate_deg_per_h);
    state.rate_deg_per_h[0] = state.valid[0] ? second_mean.rate_deg_per_h : 0;
    state.temperature_degc = second_mean.temperature_degc;
    state.uhfo_v = second_mean.uhfo_v;
    if (!encoder.can_state(state)) return {};
    if (second_mean.second > next) encoder.skip(state, static_cast<std::uint64_t>(second_mean.second - next));
    next = second_mean.second + 1;
    bytes.clear();
    encoder.encode(state, bytes);
    ++count;
    return writer->data(time_ns, bytes);
  };
  const auto recording = recordings::read_recording(choice.recording, source, push);
  if (!recording) return tl::unexpected(recording.error());
  if (auto good = recordings::UnmatchedRanges(recording->unmatched).finish(); !good)
    return tl::unexpected(good.error());
  if (!writer) return make_error(choice.recording, "found no row");
  if (!recording->sensors().empty() && !choice.quiet) {
    fmt::print(stderr, "prismcal: {}: the frames have rate, temperature and UHFO voltage, but not the sensors {}\n",
               choice.out, sensors_text(recording->sensors()));
  }
  if (const auto flushed = writer->flush(); !flushed) return tl::unexpected(flushed.error());
  fmt::print("{}: {} frames\n", choice.out, count);
  return 0;
}

}  // namespace

void add_convert_command(CLI::App& app, int& code) {
  const auto [command, choice] = new_command<ConvertChoice>(
      app, code, "convert", "convert a recording to a capture with one frame per second, for prismd --replay", convert);
  add_options(command,
              {{"recording", &choice.recording, "prismd's log (file or folder), a capture, or CSV with --map"},
               {"--out", &choice.out, "capture to write"}},
              Need::kRequired);
  add_options(command, {{"--frames", &choice.frames, "frame description with one frame per second, by name or path"}});
  add_source_options(command, choice.source);
  accept_site_options(command);  // a capture has the rate as it was measured
  add_options(command, {{"--quiet", &choice.quiet, "no remarks on stderr"}});
  tools::add_examples(command, {"prismcal convert logs/ --out record.pcap"});
}

}  // namespace prism::commands
