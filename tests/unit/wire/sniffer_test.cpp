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

TEST(Sniffer, NoBytesAreInNoFrame) { EXPECT_EQ(SniffScore{}.share(), 0); }

TEST(Sniffer, MatchesNothingInGarbage) {
  std::mt19937 random(8);
  std::vector<std::uint8_t> bytes(50'000);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  Sniffer sniffer(all_shipped());
  sniffer.feed(bytes, 0);
  for (const SniffScore& score : sniffer.ranking()) EXPECT_FALSE(score.fits) << sniff_line(score);
}

}  // namespace
}  // namespace prism::wire
