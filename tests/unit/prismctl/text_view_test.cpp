// SPDX-License-Identifier: MIT
// What a person reads in status and bias: means, never one frame; and a gyro that is gone is never good.
#include "tools/prismctl/text_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

json receiving_status() {
  return json::parse(R"({"name": "gyro1", "version": "0.2.0", "state": "receiving", "detail": "", "state_since_s": 0,
    "device": "/dev/gyro", "frames": "trplg", "clock": "host", "model": null, "quality": "good", "age_s": 0.003,
    "window_s": 100, "warm_s": 110, "full_s": 110,
    "sample": {"rate_deg_per_h": 20.0, "corrected_deg_per_h": 11.5, "quality": "good"},
    "window": {"rate_deg_per_h": 8.4, "mean_rate_deg_per_h": 8.47111, "bias_deg_per_h": 0.5, "sd_deg_per_h": 0.007,
               "corrected_deg_per_h": 7.9, "corrected_mean_deg_per_h": 7.97111, "mean_temperature_degc": 25.0,
               "slope_degc_per_s": 1e-4, "mean_uhfo_v": 5.3, "quality": "good"}})");
}

json gone_status() {
  json status = receiving_status();
  status["state"] = "connecting", status["detail"] = "unplugged (end of file)";
  status["quality"] = "no_data", status["age_s"] = 15.2, status["warm_s"] = 0;
  for (const char* row : {"sample", "window"}) {
    for (auto& [key, value] : status[row].items()) value = nullptr;
    status[row]["quality"] = "no_data";
  }
  return status;
}

// One frame of an angle in pulses is 0 or 20 deg/h: neither is a rate that anybody wants to read.
TEST(StatusView, ShowsMeansAndNotOneFrame) {
  const std::string text = status_view(receiving_status());
  EXPECT_THAT(text, HasSubstr("rate         8.40000 deg/h over 1 s, 8.47111 deg/h over 100 s\n"));
  EXPECT_THAT(text, HasSubstr("corrected    7.90000 deg/h over 1 s, 7.97111 deg/h over 100 s\n"));
  EXPECT_THAT(text, HasSubstr("bias         0.50000 ± 0.00700 deg/h\n"));
  EXPECT_THAT(text, Not(HasSubstr("20.0")));
}

TEST(StatusView, AMeanIsOfWhatIsGathered) {
  json status = receiving_status();
  status["quality"] = "warming", status["warm_s"] = 15;
  EXPECT_THAT(status_view(status), HasSubstr("8.47111 deg/h over 15 s\n"));
  EXPECT_THAT(status_view(status), HasSubstr("quality      warming (15 of 110 s), last data 0.0 s ago\n"));
}

TEST(StatusView, AGyroThatIsGoneHasNoNumber) {
  const std::string text = status_view(gone_status());
  EXPECT_THAT(text, HasSubstr("state        connecting: unplugged (end of file)"));
  EXPECT_THAT(text, HasSubstr("quality      no_data (nothing is measured now), last data 15 s ago\n"));
  EXPECT_THAT(text, HasSubstr("rate         -\n"));
  EXPECT_THAT(text, HasSubstr("corrected    -\n"));
  EXPECT_THAT(text, Not(HasSubstr("quality      good")));
  EXPECT_THAT(text, Not(HasSubstr("8.4")));
}

TEST(BiasView, ShowsMeansAndNotOneFrame) {
  const json bias = json::parse(R"({"time_s": 10, "rate_deg_per_h": 20.0, "bias_deg_per_h": 0.5, "sd_deg_per_h": 0.007,
    "corrected_deg_per_h": 19.5, "second_rate_deg_per_h": 8.4, "second_corrected_deg_per_h": 7.9,
    "mean_rate_deg_per_h": 8.47111, "corrected_mean_deg_per_h": 7.97111, "window_s": 100, "warm_s": 110, "full_s": 110,
    "quality": "good", "age_s": 0.1, "model": "a0e547ce32dbb04c"})");
  const std::string text = bias_view(bias);
  EXPECT_THAT(text, HasSubstr("rate         8.40000 deg/h over 1 s, 8.47111 deg/h over 100 s\n"));
  EXPECT_THAT(text, HasSubstr("corrected    7.90000 deg/h over 1 s, 7.97111 deg/h over 100 s\n"));
  EXPECT_THAT(text, Not(HasSubstr("20.0")));
  EXPECT_THAT(text, Not(HasSubstr("19.5")));
}

TEST(Words, ATimeIsSaidInTheTwoUnitsThatTell) {
  EXPECT_EQ(span_text(-1), "0.0 s");
  EXPECT_EQ(span_text(0.44), "0.4 s");
  EXPECT_EQ(span_text(59), "59 s");
  EXPECT_EQ(span_text(125), "2 min 5 s");
  EXPECT_EQ(span_text(3600 * 3 + 60 * 20), "3 h 20 min");
  EXPECT_EQ(span_text(86400 * 4 + 7300), "4 d 2 h");
  EXPECT_EQ(age_text(nullptr), "no data yet");
}

}  // namespace
}  // namespace prism::prismctl
