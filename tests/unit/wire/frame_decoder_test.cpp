// SPDX-License-Identifier: MIT
// The decoder and the encoder: frames in chunks, damage and garbage, the rules that recognise a frame, and text frames
// (frame_decoder.txt).
#include "drivers/wire/decode/frame_decoder.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include "base/text_number.hpp"
#include "drivers/commands.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "tests/support/scripts.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using test::next;
using Bytes = std::vector<std::uint8_t>;
using Lines = std::vector<std::string>;

std::string message_type(const std::string& members, const std::string& rest) {
  return R"({"format": "prism-frames", "version": 1, "name": "x", "line": {"baud": 115200}, "rate_hz": 10,
    "kinds": [{"name": "k", )" +
         members + R"(}], "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}})" + rest + "}";
}

const std::string kCrc = R"("checks": {"kind": "crc", "width": 16, "poly": "0x1021", "to": -2, "at": -2}, )";

/// Descriptions for these tests.
const std::map<std::string, std::string> kDescriptions = {
    // damage can make the decoder wait for bytes that never come
    {"length", message_type(R"("sync": {"bytes": "AB"}, "length": {"at": 1, "type": "u8", "min": 6, "max": 255}, )" +
                                kCrc + R"("fields": {"rate": {"at": 2, "type": "s16"}})",
                            "")},
    // 600 counted frames a second, of which 100 have gyro data; a temperature in halves
    {"halves", message_type(R"("sync": {"bytes": "AB CD"}, "length": 7, )" + kCrc +
                                R"("fields": {"rate": {"at": 2, "type": "u8"}, "which": {"at": 3, "type": "u8"},
                 "high": {"at": 4, "type": "u8", "when": {"field": "which", "values": 1}},
                 "low": {"at": 4, "type": "u8", "when": {"field": "which", "values": 2}}})",
                            R"(, "counter": {"field": "rate", "ticks_per_s": 600, "step": 1},
    "temperature": {"high": "high", "low": "low", "stale_after_s": 0.05})")},
    {"bounds", message_type(R"("sync": {"bytes": "AB CD"}, "length": 8, "checks": {"kind": "sum", "to": -1, "at": -1},
               "fields": {"rate": {"at": 2, "type": "s16", "min": -100, "max": 100},
                          "t": {"at": 4, "type": "s16", "min": -80, "max": 125}, "u": {"at": 6, "type": "u8"}})",
                            R"(, "temperature": {"field": "t"}, "uhfo": {"field": "u"})")},
    // 400 frames a second with two sensors in turn
    {"in-turn",
     message_type(
         R"("sync": {"bytes": "AB CD"}, "length": 6, "checks": {"kind": "sum", "to": -1, "at": -1},
                "fields": {"which": {"at": 2, "type": "u8"}, "rate": {"at": 3, "type": "u8"},
                           "a": {"at": 4, "type": "u8", "when": {"field": "which", "values": 0}},
                           "b": {"at": 4, "type": "u8", "when": {"field": "which", "values": 1}}})",
         R"(, "sensors": {"a": {"field": "a", "unit": "V"}, "b": {"field": "b", "unit": "V"}}, "counter": {"field": "rate",
                "ticks_per_s": 400, "step": 1})")},
};

/// Bytes wait until "feed" gives them to the decoder, which prints its readings.
class FramePlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "gyro") {
      const auto name = next<std::string>(words);
      const auto own = kDescriptions.find(name);
      GyroChoice choice;
      choice.sensors = next<std::string>(words) == "sensors";
      use(own == kDescriptions.end() ? test::shipped(name, choice) : test::description_of(own->second, choice));
    } else if (command == "type") {  // MEMBERS of its message type | REST of the description
      std::string members = test::rest_of(words) + " | ";
      const std::size_t bar = members.find(" | "), end = members.find(" | ", bar + 1);
      use(test::description_of(message_type(members.substr(0, bar),
                                            end == std::string::npos ? "" : members.substr(bar + 3, end - bar - 3))));
      if (frames_->counter) return {fmt::format("counter modulo {}", frames_->counter->modulus)};
    } else if (command == "columns") {  // [SEPARATORS [,] [cr]]: NAME COLUMN [MIN MAX] of an instrument without a gyro
      return columns(words);
    } else if (command == "frames") {  // N [changes of the state]: of a gyro whose rate and temperature rise
      for (int left = take_state(words); left > 0; --left) {
        encoder_->encode(state_, bytes_);
        state_.rate_deg_per_h[0] += 1;
        state_.temperature_degc += 0.01;
      }
    } else if (command == "lost") {
      encoder_->skip(state_, static_cast<std::uint64_t>(take_state(words)));
    } else if (command == "vector") {
      append(frames_->test_vectors[0].bytes);
    } else if (command == "hex") {
      append(hex_bytes(test::rest_of(words)));
    } else if (command == "text") {
      const std::string text = test::rest_of(words) + "\r\n";
      append({text.begin(), text.end()});
    } else if (command == "raw") {  // with \n and \r
      std::string text = test::rest_of(words);
      for (std::size_t at; (at = text.find("\\r")) != std::string::npos;) text.replace(at, 2, "\r");
      append({text.begin(), text.end()});
    } else if (command == "noise") {  // BYTES SEED
      const auto count = next<std::size_t>(words);
      std::mt19937 random(next<unsigned>(words));
      for (std::size_t i = 0; i < count; ++i) bytes_.push_back(static_cast<std::uint8_t>(random()));
    } else if (command == "flip") {  // AT MASK
      const auto at = next<std::size_t>(words);
      bytes_[at] ^= static_cast<std::uint8_t>(std::stoi(next<std::string>(words), nullptr, 16));
    } else if (command == "cut") {  // FROM COUNT
      const auto at = bytes_.begin() + next<std::ptrdiff_t>(words);
      bytes_.erase(at, at + next<std::ptrdiff_t>(words));
    } else if (command == "bytes") {  // that wait, and forgets them
      return {bytes_.empty() ? "none" : drivers::bytes_text(std::exchange(bytes_, {}))};
    } else if (command == "feed") {  // [COUNT] at US [each COUNT US]: in chunks, or at once
      return feed(words);
    } else if (command == "sniff") {  // the bytes, the first of them a second before
      Sniffer sniffer({frames_});
      sniffer.feed(std::span(bytes_).first(13), 0);
      sniffer.feed(std::span(bytes_).subspan(13), 1'000'000'000);
      return {sniff_line(sniffer.ranking()[0])};
    } else if (command == "expire") {
      decoder_->expire(1000 * next<std::int64_t>(words), readings_);
    } else if (command == "finish") {
      decoder_->finish(readings_);
    } else if (command == "reset") {
      decoder_->reset();
    } else if (command == "counters") {
      const DecoderCounters& c = decoder_->counters();
      std::string text =
          fmt::format("{} bytes, {} frames, {} bad_check, {} skipped, {} resyncs, {} timeouts, {} held", c.bytes,
                      c.frames, c.bad_check, c.skipped_bytes, c.resyncs, c.timeouts, decoder_->held_bytes());
      for (const auto& [count, name] : {std::pair{c.bad_length, "bad_length"},
                                        {c.bad_body, "bad_body"},
                                        {c.refused, "refused"},
                                        {c.unconfirmed, "unconfirmed"},
                                        {c.out_of_range, "out_of_range"}})
        if (count > 0) text += fmt::format(", {} {}", count, name);
      return {text};
    } else {
      return {"unknown command"};
    }
    return shown();
  }

 private:
  void use(FrameDescriptionPtr frames) {
    frames_ = std::move(frames);
    encoder_.emplace(frames_);
    decoder_.emplace(frames_);
  }

  Lines columns(std::istream& words) {
    GyroChoice choice;
    choice.sensors = true;
    for (std::string word; words >> word;) {
      if (word == "blanks") {
        choice.text.separators = " ";
      } else if (word == "separators") {
        choice.text.separators = next<std::string>(words);
      } else if (word == "comma") {
        choice.text.decimal_comma = true;
      } else if (word == "cr") {
        choice.text.ends_with_cr = true;
      } else if (word == "in") {
        choice.text.columns.back().min = next<double>(words);
        choice.text.columns.back().max = next<double>(words);
      } else {
        choice.text.columns.push_back({{word, "degC"}, next<int>(words)});
      }
    }
    const auto parsed =
        parse_frame_description(test::read_file(test::frames_dir() / "ascii-columns.json"), "f.json", choice);
    if (!parsed) return {parsed.error().text()};
    use(*parsed);
    return {};
  }

  int take_state(std::istream& words) {
    const auto count = next<int>(words);
    for (std::string word; words >> word;) {
      if (word == "rate") state_.rate_deg_per_h[0] = next<double>(words);
      if (word == "temperature") state_.temperature_degc = next<double>(words, kUnknown), words.clear();
      if (word == "uhfo") state_.uhfo_v = next<double>(words);
      if (word == "invalid") state_.valid[0] = false;
    }
    return count;
  }
  void append(const Bytes& bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }

  Lines feed(std::istream& words) {
    std::size_t left = bytes_.size(), chunk = left;
    std::int64_t us = 0, step_us = 0;
    if (std::isdigit((words >> std::ws).peek())) left = chunk = next<std::size_t>(words);
    for (std::string word; words >> word;) {
      if (word == "at") us = next<std::int64_t>(words);
      if (word == "each") chunk = next<std::size_t>(words), step_us = next<std::int64_t>(words);
    }
    for (; left > 0; us += step_us) {
      const std::size_t size = std::min(left, chunk);
      decoder_->feed(std::span(bytes_).first(size), 1000 * us, readings_);
      bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
      left -= size;
    }
    return shown();
  }

  Lines shown() {
    constexpr std::size_t kMost = 12;
    Lines lines;
    const std::vector<DecodedMessage> all = std::exchange(readings_, {});
    if (all.size() > kMost) lines.push_back(fmt::format("{} readings, of them the last:", all.size()));
    for (std::size_t i = all.size() - std::min(all.size(), all.size() > kMost ? 1 : kMost); i < all.size(); ++i) {
      const DecodedMessage& r = all[i];
      std::string line = fmt::format("{}:", r.offset);
      for (std::size_t k = 0; k < frames_->sensors().size(); ++k) line += fmt::format(" {:g}", r.sensors[k]);
      if (frames_->carries_gyro())
        line += fmt::format(" {:.10g}{}", r.gyro[0].value, r.gyro[0].valid ? "" : " invalid");
      if (r.gyro[0].out_of_bounds) line += " out of bounds";
      if (r.has_counter) line += fmt::format(", counter {}", r.counter);
      if (frames_->has(ChannelRole::kTemperature)) line += fmt::format(", {:.4g} degC", r.temperature_degc);
      if (frames_->has(ChannelRole::kUhfo)) line += fmt::format(", {:.4g} V", r.uhfo_v);
      if (r.out_of_bounds.any()) line += " out of bounds";
      if (!r.has_gyro) line += ", no gyro";
      if (r.damaged > 0) line += fmt::format(", {} damaged", r.damaged);
      if (r.status != 0) line += fmt::format(", status {:x}", r.status);
      lines.push_back(line + fmt::format(", at {} us", std::llround(1e-3 * static_cast<double>(r.arrival_ns))));
    }
    return lines;
  }

  FrameDescriptionPtr frames_;
  std::optional<FrameEncoder> encoder_;
  std::optional<FrameDecoder> decoder_;
  GyroState state_{.rate_deg_per_h = {8.4652}, .interval_s = 0.005, .temperature_degc = 25, .uhfo_v = 5.3};
  Bytes bytes_;
  std::vector<DecodedMessage> readings_;
};

TEST(FrameDecoder, Scripts) { test::expect_scripts<FramePlayer>("wire/frame_decoder.txt"); }

TEST(FrameDecoder, LosesOnlyADamagedFrame) {
  const auto description = test::shipped("trplg");
  FrameEncoder encoder(description);
  Bytes good;
  for (int i = 0; i < 5; ++i) encoder.encode({.rate_deg_per_h = {8.4652 + i}, .interval_s = 0.005}, good);
  for (std::size_t at = 0; at < 20; ++at) {
    Bytes bytes = good;
    bytes[40 + at] ^= 0x10;
    const auto readings = test::decode(description, bytes);
    ASSERT_EQ(readings.size(), 4u) << "damaged byte " << at;
    EXPECT_EQ(readings[2].offset, 60u);
  }
}

// The ASCII output of the DSP-3000 has no checksum: a line that lost a decimal was accepted as another rate.
TEST(FrameDecoder, RejectsALineThatLostACharacter) {
  const auto description = test::shipped("dsp3000-ascii");
  const std::string good = "    -123.456789   1\r\n";
  const std::size_t point = good.find('.'), sign = good.find('-');
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string line = good;
    std::string stream = good;
    stream.append(line.erase(at, 1)).append(good).append(good);
    for (const DecodedMessage& reading : test::decode(description, {stream.begin(), stream.end()})) {
      const bool seen = at < sign || at >= point;  // the manual states no width: a sign or a first digit may be missing
      if (seen && reading.gyro[0].valid) {
        EXPECT_EQ(reading.gyro[0].value, -123.456789) << "without character " << at;
      }
    }
  }
}

// Plausibility limits are read in the units of the quantities. Logs identify a description by its id: adding a limit
// does not change the decoding.
TEST(Beliefs, AreReadAndNotPartOfTheId) {
  const std::string plain = kDescriptions.at("bounds");
  const auto with = [&](const std::string& gyro, const std::string& temperature, const std::string& uhfo) {
    std::string text = plain;
    for (const auto& [before, added] :
         {std::pair("{\"z\": \"rate\"}", gyro), {"\"field\": \"t\"", temperature}, {"\"field\": \"u\"", uhfo}})
      text.insert(text.find(before) + std::string_view(before).size(), added);
    return test::description_of(text);
  };
  const auto d = with(R"(, "range_deg_per_s": [-490, 490])",
                      R"(, "range": [-40, 75], "greatest_slope_degc_per_s": 0.5)", R"(, "range": [0, 16])");
  EXPECT_EQ(d->plausible.rate.range->max, 490 * 3600.0);
  EXPECT_EQ(d->plausible.temperature.range->min, -40);
  EXPECT_EQ(d->plausible.temperature.greatest_slope_per_s, 0.5);
  EXPECT_EQ(d->plausible.uhfo.range->max, 16);
  EXPECT_FALSE(d->plausible.temperature.stuck_s);
  const auto without = test::description_of(plain);
  EXPECT_FALSE(without->plausible.rate.range || without->plausible.temperature.range);
  EXPECT_EQ(without->id, d->id);
  EXPECT_NE(without->id, with("", R"(, "stale_after_s": 2)", "")->id);
}

}  // namespace
}  // namespace prism::wire
