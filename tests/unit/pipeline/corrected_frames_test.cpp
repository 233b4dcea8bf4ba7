// SPDX-License-Identifier: MIT
#include "daemon/pipeline/corrected_frames.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/unit/wire/descriptions.hpp"

namespace prism::pipeline {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A stream of frames with a steady rate, and an output of it.
class Line {
 public:
  /// `own`: the frames of the output; null: as in `config`.
  explicit Line(const std::string& description,
                config::OutputConfig config = {.frames = "same", .hold_s = 0, .then_drop = false},
                const wire::FrameDescriptionPtr& own = nullptr)
      : frames_(test::shipped(description, {.sensors = own != nullptr})), encoder_(frames_), decoder_(frames_) {
    setup_.frames = frames_;
    setup_.axes.resize(1);
    std::vector<SensorName> sensors;
    for (const wire::Channel& rule : frames_->sensors()) sensors.push_back(rule.sensor);
    setup_.sensors = std::make_shared<const std::vector<SensorName>>(std::move(sensors));
    setup_.outputs = {{std::move(config), own, {}}};
    output_.emplace(setup_, 0);
  }

  /// One frame; `bias`: the engine's, kUnknown: none. Returns the bytes that left.
  Bytes frame(double rate, double bias, bool has_sample = true) {
    Bytes in;
    wire::GyroState state{.rate_deg_per_h = {rate}, .interval_s = frames_->period_s(), .temperature_degc = 20};
    for (std::size_t i = 0; i < state.sensors.size(); ++i) state.sensors[i] = 20 + static_cast<double>(i);
    encoder_.encode(state, in);
    std::vector<wire::DecodedMessage> found;
    decoder_.feed(in, time_ns_ += 1'000'000, found);
    Rows rows;
    for (const wire::DecodedMessage& message : found) {
      if (message.has_gyro) rows.frames.push_back({.message = message});
    }
    if (has_sample && !rows.frames.empty()) {
      Rows::Sample& sample = rows.samples.emplace_back();
      sample.row.sample.time_ns = time_ns_;
      sample.row.sample.rate_deg_per_h = rate;
      sample.row.sample.temperature_degc = state.temperature_degc;
      sample.row.sample.interval_s = frames_->period_s();
      sample.row.correction = {.bias_deg_per_h = bias, .quality = std::isnan(bias) ? 1U : 0U};
      sample.row.corrected_deg_per_h = rate - bias;
      rows.frames.back().sample_count = 1;
    }
    return output_->push(in, rows, decoder_);
  }
  /// Bytes that complete no frame. Returns the bytes that left.
  Bytes bytes(const Bytes& in) {
    std::vector<wire::DecodedMessage> none;
    decoder_.feed(in, time_ns_ += 1'000'000, none);
    EXPECT_TRUE(none.empty());
    Rows rows;
    return output_->push(in, rows, decoder_);
  }
  /// Frames that left, or did not, in this form.
  std::uint64_t count(Form form) const { return output_->counters().by_form[static_cast<std::size_t>(form)]; }
  CorrectedFrames& output() { return *output_; }
  const wire::FrameDescriptionPtr& frames() const { return frames_; }

 private:
  wire::FrameDescriptionPtr frames_;
  wire::FrameEncoder encoder_;
  wire::FrameDecoder decoder_;
  Setup setup_;
  std::optional<CorrectedFrames> output_;
  std::int64_t time_ns_ = 0;
};

// The correction is far below a unit of the field, and the mean of the sent rates is right all the same.
TEST(CorrectedFrames, RoundsWithoutBias) {
  for (const char* name : {"trplg", "trplg-increment", "hg4930", "stim300", "novatel-rawimusx"}) {
    Line plain(name), line(name);
    constexpr int kFrames = 5000;
    constexpr double kRate = 1234.567, kBias = 0.0123;
    Bytes raw, sent;
    for (int i = 0; i < kFrames; ++i) {
      for (const std::uint8_t byte : plain.frame(kRate, kUnknown)) raw.push_back(byte);
      for (const std::uint8_t byte : line.frame(kRate, kBias)) sent.push_back(byte);
    }
    ASSERT_EQ(sent.size(), raw.size()) << name;
    auto before = test::decode(line.frames(), raw), after = test::decode(line.frames(), sent);
    for (auto* readings : {&before, &after}) std::erase_if(*readings, [](const auto& each) { return !each.has_gyro; });
    ASSERT_EQ(after.size(), before.size()) << name;
    const wire::GyroRule& gyro = line.frames()->gyro;
    const double scale = line.frames()->axes[0].scale, period = line.frames()->period_s();
    double difference = 0;
    for (std::size_t i = 0; i < after.size(); ++i) difference += before[i].gyro[0].value - after[i].gyro[0].value;
    if (gyro.meaning == wire::RateEncoding::kAccumulated)
      difference = before.back().gyro[0].value - after.back().gyro[0].value;
    const bool rate = gyro.meaning == wire::RateEncoding::kRate;
    const double frames = static_cast<double>(after.size()), span = rate ? frames : period * frames;
    const double mean = difference * scale / span;
    const wire::MessageType& kind = line.frames()->kinds[static_cast<std::size_t>(after[0].kind)];
    const double unit = std::abs(kind.fields[static_cast<std::size_t>(kind.roles.axes[0].gyro[0])].scaling.scale) *
                        std::abs(scale) * (kind.structure == wire::Structure::kColumns ? 1e-6 : 1);
    EXPECT_NEAR(mean, kBias, 1.01 * unit / span + 1e-12) << name;
    EXPECT_EQ(line.count(Form::kCorrected), after.size()) << name;
  }
}

TEST(CorrectedFrames, FadesASwitchAndFollowsTheEngineOtherwise) {
  Line line("dmu11", {.frames = "prism", .hold_s = 0, .then_drop = false, .fade_deg_per_h_per_s = 1});
  const double step = line.frames()->period_s();
  const auto sent = [&](double bias) {
    const Bytes message = line.frame(10, bias);
    double correction = kUnknown;
    if (message.size() == 44) std::memcpy(&correction, message.data() + 24, 8);
    return correction;
  };
  EXPECT_EQ(sent(kUnknown), 0) << "raw";
  EXPECT_NEAR(sent(3 * step), step, 1e-12) << "the correction begins";
  EXPECT_NEAR(sent(3 * step), 2 * step, 1e-12);
  EXPECT_NEAR(sent(3 * step), 3 * step, 1e-12);
  EXPECT_EQ(sent(0.5), 0.5) << "the engine's change is the engine's";
  line.output().correction_changed();
  EXPECT_NEAR(sent(0.1), 0.5 - step, 1e-12) << "another model";
  EXPECT_EQ(line.count(Form::kRaw), 1u);
  EXPECT_EQ(line.count(Form::kFading), 3u);
  EXPECT_EQ(line.count(Form::kCorrected), 2u);
}

TEST(CorrectedFrames, SendsWhatThePolicySaysWithoutACorrection) {
  using config::WhenUnknown;
  const double none = kUnknown;
  Line raw("trplg"), plain("trplg");
  EXPECT_EQ(raw.frame(100, none), plain.frame(100, none, false)) << "as received";
  Line drop("trplg", {.frames = "same", .when_unknown = WhenUnknown::kDrop, .hold_s = 0});
  EXPECT_TRUE(drop.frame(100, none).empty());
  EXPECT_TRUE(drop.frame(100, none, false).empty()) << "held back by the counter check";
  EXPECT_FALSE(drop.frame(100, 20).empty());
  EXPECT_EQ(drop.count(Form::kDropped), 2u);
  Line hold("trplg", {.frames = "same", .when_unknown = WhenUnknown::kHold, .hold_s = 0.0015, .then_drop = true});
  EXPECT_TRUE(hold.frame(100, none).empty()) << "nothing to hold yet";
  EXPECT_FALSE(hold.frame(100, 20).empty());
  EXPECT_FALSE(hold.frame(100, none).empty());
  EXPECT_TRUE(hold.frame(100, none).empty()) << "too old";
  EXPECT_EQ(hold.count(Form::kCorrected), 1u);
  EXPECT_EQ(hold.count(Form::kFading) + hold.count(Form::kHeld), 1u);
}

TEST(CorrectedFrames, PassesOtherBytesInTheirPlaces) {
  Line line("dmu11");
  line.frame(10, 1);
  // Bytes that may begin a frame wait until the decoder has decided: 55 is the first byte of a frame.
  EXPECT_EQ(line.bytes({1, 2, 3, 0x55}), (Bytes{1, 2, 3}));
  EXPECT_EQ(line.bytes({9}), (Bytes{0x55, 9}));
}

TEST(CorrectedFrames, EncodesEachSensor) {
  const auto own = test::shipped("kvh-geo-fog", {.sensors = true});
  Line line("kvh-geo-fog", {.frames = "kvh-geo-fog"}, own);
  Bytes sent;
  for (int i = 0; i < 3; ++i) {
    for (const std::uint8_t byte : line.frame(100, 20)) sent.push_back(byte);
  }
  const auto readings = test::decode(own, sent);
  ASSERT_FALSE(readings.empty());
  EXPECT_NEAR(readings.back().gyro[0].value * own->axes[0].scale, 80, 0.5);
  ASSERT_EQ(own->sensors().size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(readings.back().sensors[i], static_cast<double>(20 + i)) << i;
}

// The example of docs/wire.md.
TEST(Message, IsTheDocumentedOne) {
  Bytes found;
  Rows::Sample sample;
  sample.row.sample.time_ns = 1'795'425'060'000'000'000;
  sample.row.sample.rate_deg_per_h = 8.5;
  sample.row.correction = {.sd_deg_per_h = 0.0084, .quality = 0};
  append_message(sample, 4660, 0.03125, Form::kCorrected, found);
  std::string text;
  for (std::size_t i = 0; i < found.size(); ++i)
    text += fmt::format("{}{:02X}", i == 0 ? "" : i == 24 ? "\n    " : " ", found[i]);
  const std::string page = test::read_file(std::filesystem::path(PRISM_SOURCE_DIR) / "docs" / "wire.md");
  EXPECT_NE(page.find(text), std::string::npos) << text;
}

}  // namespace
}  // namespace prism::pipeline
