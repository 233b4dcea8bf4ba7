// SPDX-License-Identifier: MIT
// The sniffer recognises an unknown line by its bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "drivers/wire/decode/inspect.hpp"
#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

std::vector<FrameDescriptionPtr> all_shipped() {
  std::vector<FrameDescriptionPtr> all;
  for (const auto& entry : std::filesystem::directory_iterator(test::frames_dir())) {
    if (entry.path().extension() == ".json" && entry.path().stem() != "frame.schema")
      all.push_back(test::shipped(entry.path().stem()));
  }
  return all;
}

std::vector<std::uint8_t> second_of(const FrameDescriptionPtr& description) {
  FrameEncoder encoder(description);
  std::mt19937 random(2);
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 200; ++i) {
    const double rate = 10 + 0.01 * static_cast<double>(random() % 100);
    encoder.encode(
        {.rate_deg_per_h = {rate}, .interval_s = description->period_s(), .temperature_degc = 30, .uhfo_v = 3}, bytes);
  }
  bytes.erase(bytes.begin(), bytes.begin() + 7);  // the data start in the middle of a frame
  return bytes;
}

TEST(Sniffer, RecognisesEveryShippedDescription) {
  const auto all = all_shipped();
  for (const FrameDescriptionPtr& truth : all) {
    if (truth->sent_kinds.empty()) continue;  // text lines without configured columns
    Sniffer sniffer(all);
    sniffer.feed(second_of(truth), 0);
    const auto ranking = sniffer.ranking();
    const auto found = std::find_if(ranking.begin(), ranking.end(),
                                    [&](const SniffScore& s) { return s.description->name == truth->name; });
    EXPECT_TRUE(found->fits) << sniff_line(*found);
    EXPECT_GE(found->share() + 0.02, ranking[0].share()) << truth->name << " behind " << sniff_line(ranking[0]);
    const auto fitting = std::count_if(ranking.begin(), ranking.end(), [](const SniffScore& s) { return s.fits; });
    EXPECT_LE(fitting, 2) << truth->name << ": KVH's two share their frame, others share nothing";
  }
}

TEST(Sniffer, MatchesNothingInGarbage) {
  std::mt19937 random(8);
  std::vector<std::uint8_t> bytes(50'000);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  Sniffer sniffer(all_shipped());
  sniffer.feed(bytes, 0);
  for (const SniffScore& score : sniffer.ranking()) EXPECT_FALSE(score.fits) << sniff_line(score);
}

TEST(Sniffer, DoesNotMatchRareFrames) {
  const auto description = test::shipped("trplg");
  std::vector<std::uint8_t> bytes(10'000, 0x5A);
  const auto frames = second_of(description);
  bytes.insert(bytes.end(), frames.begin(), frames.end());
  Sniffer sniffer({description});
  sniffer.feed(bytes, 0);
  const SniffScore score = sniffer.ranking()[0];
  EXPECT_EQ(score.frames, 199u);
  EXPECT_FALSE(score.fits) << "most of the line is something else";
}

TEST(Sniffer, NeedsMoreThanOneFrame) {
  const auto description = test::shipped("trplg");
  auto bytes = second_of(description);
  bytes.resize(13 + 20 - 5);  // the rest of a frame, one complete, the start of the next
  Sniffer sniffer({description});
  sniffer.feed(bytes, 0);
  const SniffScore score = sniffer.ranking()[0];
  EXPECT_EQ(score.frames, 0u) << "a weak frame waits for confirmation";
  bytes = second_of(description);
  bytes.resize(13 + 2 * 20);
  Sniffer two({description});
  two.feed(bytes, 0);
  EXPECT_FALSE(two.ranking()[0].fits);
  EXPECT_TRUE(two.ranking()[0].too_few) << sniff_line(two.ranking()[0]);
  EXPECT_TRUE(sniff_line(two.ranking()[0]).ends_with(": too few, at least 3 are needed"));
}

TEST(Sniffer, ReportsCountsAndTheRate) {
  const auto description = test::shipped("trplg");
  const auto bytes = second_of(description);
  Sniffer sniffer({description});
  sniffer.feed(std::span(bytes).first(13), 0);
  sniffer.feed(std::span(bytes).subspan(13), 1'000'000'000);
  EXPECT_EQ(sniff_line(sniffer.ranking()[0]), "trplg              fits  199 frames, 99.7 % of 3993 bytes, 199 Hz");
}

}  // namespace
}  // namespace prism::wire
