// SPDX-License-Identifier: MIT
// Real bytes of real devices, decoded by descriptions: the values match their sources, and damage is rejected.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/support/scripts.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using test::next;
using Bytes = std::vector<std::uint8_t>;
using Lines = std::vector<std::string>;

/// Frames that a manual prints, or that were made from documents, are in the source tree; recorded bytes are shared
/// data.
std::filesystem::path frames_file(const std::string& file) {
  const auto here = std::filesystem::path(PRISM_SOURCE_DIR) / "tests" / "unit" / "wire" / "data" / file;
  return std::filesystem::exists(here) ? here : test::shared_dir() / "frames" / file;
}

/// Of a text: its lines without comments and with CR LF, as the device sends them.
Bytes bytes_of(const std::string& file) {
  std::string text = test::read_file(frames_file(file));
  if (!file.ends_with(".txt")) return {text.begin(), text.end()};
  std::istringstream in(std::exchange(text, ""));
  for (std::string line; std::getline(in, line);)
    if (!line.starts_with('#')) text += line.substr(0, line.find('\r')) + "\r\n";
  return {text.begin(), text.end()};
}

/// The frames of a .hex file by their names, in order.
std::vector<std::pair<std::string, Bytes>> hex_frames(const std::string& file) {
  std::istringstream in(test::read_file(frames_file(file)));
  std::vector<std::pair<std::string, Bytes>> frames;
  for (std::string line; std::getline(in, line);) {
    if (const auto at = line.find("# frame: "); at != std::string::npos) {
      std::istringstream words(line.substr(at + 9));
      words >> frames.emplace_back().first;
    } else if (!line.empty() && line[0] != '#') {
      std::istringstream words(line);
      for (std::string word; words >> word;)
        frames.back().second.push_back(static_cast<std::uint8_t>(std::stoi(word, nullptr, 16)));
    }
  }
  return frames;
}

/// Frames of files, decoded by descriptions. "FIELD…" prints these fields, "-" for one that is not in the frame.
class FixturePlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "frames") {
      frames_ = test::shipped(next<std::string>(words));
    } else if (command == "hex") {  // FILE N FIELD…: one frame
      const auto file = next<std::string>(words);
      return {fields_of(hex_frames(file)[next<std::size_t>(words)].second, words)};
    } else if (command == "walk") {  // FILE FIELD…: all frames up to the first other byte
      const Bytes bytes = bytes_of(next<std::string>(words));
      std::string fields;
      std::getline(words, fields);
      Lines lines;
      for (std::size_t at = 0; at < bytes.size();) {
        const auto rest = std::span(bytes).subspan(at);
        const auto frame = inspect_frame(*frames_, rest);
        if (!frame) break;
        at += frame->length;
        std::istringstream of(fields);
        lines.push_back(fields_of(rest, of));
      }
      return lines;
    } else if (command == "decode") {  // FILE [N] [flip AT]: the readings of its frames, or of one
      const auto file = next<std::string>(words);
      Bytes stream;
      const std::string which = next<std::string>(words);
      const auto frames = file.ends_with(".hex") ? hex_frames(file) : std::vector{std::pair(file, bytes_of(file))};
      for (std::size_t i = 0; i < frames.size(); ++i) {
        if (which.empty() || which == frames[i].first || which == std::to_string(i))
          stream.insert(stream.end(), frames[i].second.begin(), frames[i].second.end());
      }
      if (file.ends_with(".txt")) {  // after the end of a line; a line may need another to confirm it
        const Bytes again = stream;
        stream.insert(stream.begin(), {'\r', '\n'});
        stream.insert(stream.end(), again.begin(), again.end());
      }
      if (next<std::string>(words) == "flip") stream[next<std::size_t>(words)] ^= 1;
      return readings_of(stream);
    } else if (command == "spec") {  // NAME: these frames of spec_frames.hex, complete
      const auto name = next<std::string>(words);
      Lines lines;
      for (const auto& [frame, bytes] : hex_frames("spec_frames.hex")) {
        const auto found = frame == name ? inspect_frame(*frames_, bytes) : std::nullopt;
        if (frame == name) lines.push_back(fmt::format("{} of {} bytes", found ? found->length : 0, bytes.size()));
      }
      return lines;
    }
    return {};
  }

 private:
  std::string fields_of(std::span<const std::uint8_t> bytes, std::istream& words) const {
    const auto frame = inspect_frame(*frames_, bytes);
    if (!frame) return "no frame";
    std::string text = fmt::format("{} bytes", frame->length);
    for (std::string field; words >> field;) {
      const auto found = std::find_if(frame->values.begin(), frame->values.end(),
                                      [&](const InspectedFrame::Value& value) { return value.field == field; });
      text += found == frame->values.end() ? ", -" : fmt::format(", {:.9g}", found->value);
    }
    return text;
  }

  Lines readings_of(const Bytes& stream) const {
    Lines lines;
    for (const DecodedMessage& r : test::decode(frames_, stream)) {
      std::string line = fmt::format("{}: {:.9g}{}", r.offset, r.gyro[0].value, r.gyro[0].valid ? "" : " invalid");
      if (r.has_counter) line += fmt::format(", counter {}", r.counter);
      if (frames_->has(ChannelRole::kTemperature)) line += fmt::format(", {:.9g} degC", r.temperature_degc);
      if (frames_->has(ChannelRole::kUhfo)) line += fmt::format(", {:.9g} V", r.uhfo_v);
      lines.push_back(line + fmt::format(", {:g} us", 1e6 * r.latency_s));
    }
    return lines;
  }

  FrameDescriptionPtr frames_;
};

TEST(Fixtures, OfTheSourceTreeDecode) { test::expect_scripts<FixturePlayer>("wire/fixtures.txt"); }

TEST(Fixtures, OfOtherSourcesDecode) {
  PRISM_NEEDS_SHARED("frames/mip_3dm.hex");
  test::expect_scripts<FixturePlayer>("wire/captures.txt");
}

/// The rates of turn of the golden text, in order: x, y, z, x, …
std::vector<double> golden_rates(const std::string& file) {
  std::istringstream in(test::read_file(test::shared_dir() / "frames" / file));
  std::vector<double> rates;
  int left = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("RateOfTurn"))
      left = 3;
    else if (left > 0)
      rates.push_back(std::stod(line.substr(line.find(':') + 1))), --left;
  }
  return rates;
}

TEST(Captures, XsensRatesEqualTheGoldenRates) {
  PRISM_NEEDS_SHARED("frames/xsens_mtdata2_1.bin");
  int compared = 0;
  for (const std::string number : {"1", "2"}) {
    const auto golden = golden_rates("xsens_mtdata2_" + number + ".expected.txt");
    ASSERT_FALSE(golden.empty());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      GyroChoice choice;
      choice.axes = {{.axis = std::string(1, "xyz"[axis])}};
      const auto readings =
          test::decode(test::shipped("xsens-mtdata2", choice), bytes_of("xsens_mtdata2_" + number + ".bin"));
      ASSERT_EQ(readings.size(), 100u);
      std::size_t next = axis;
      for (std::size_t i = 0; i < readings.size(); ++i) {
        EXPECT_EQ(readings[i].counter, readings[0].counter + i);
        if (!readings[i].gyro[0].valid) continue;  // a message without a rate of turn
        ASSERT_LT(next, golden.size());
        EXPECT_EQ(readings[i].gyro[0].value, golden[next]);
        next += 3;
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 2 * 288) << "every stated number of both files";
}

TEST(Captures, MipCaptureDecodesCompletely) {
  PRISM_NEEDS_SHARED("frames/mip_data.bin");
  FrameDecoder decoder(test::shipped("microstrain-mip"));
  std::vector<DecodedMessage> readings;
  decoder.feed(bytes_of("mip_data.bin"), 0, readings);
  decoder.finish(readings);
  EXPECT_EQ(decoder.counters().frames, 8384u);
  EXPECT_EQ(decoder.counters().skipped_bytes, 0u);
  std::size_t timed = 0;
  std::uint64_t last = 0;
  for (const DecodedMessage& reading : readings) {
    if (!reading.has_counter) continue;
    EXPECT_EQ(reading.counter - last, timed > 0 ? 8'000'000u : reading.counter);
    last = reading.counter;
    ++timed;
  }
  EXPECT_EQ(timed, 4473u);
}

// frames.md, section 4: on these captures other decoders lose up to one frame in eight.
TEST(Captures, NoIntactFrameIsLostNextToDamagedOnes) {
  PRISM_NEEDS_SHARED("frames/mip_data.bin");
  for (const auto& [file, name] : {std::pair{"mip_data.bin", "microstrain-mip"},
                                   {"xsens_mtdata2_1.bin", "xsens-mtdata2"},
                                   {"xsens_mtdata2_2.bin", "xsens-mtdata2"},
                                   {"ixblue_stdbin_v3.bin", "ixblue-stdbin"}}) {
    const auto description = test::shipped(name);
    const Bytes good = bytes_of(file);
    const auto frames = test::decode(description, good);
    ASSERT_GT(frames.size(), 10u) << file;
    std::vector<test::Part> parts;
    for (const DecodedMessage& frame : frames) parts.push_back({frame.offset, frame.length});
    for (const test::Damage what : test::kDamages) {
      const auto [lost, found] = test::lost_frames(description, good, parts, what);
      EXPECT_EQ(lost, 0u) << file << " damage " << static_cast<int>(what) << " of " << found;
    }
  }
}

}  // namespace
}  // namespace prism::wire
