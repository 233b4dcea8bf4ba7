// SPDX-License-Identifier: MIT
// The text of a model has its origin, its quality and its expected errors; that of stability ends with a conclusion.
#include "tools/prismctl/model_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace prism::prismctl {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json trained() {
  return json::parse(
      R"({"name": "composite T,dTdt", "kind": "composite", "id": "d5ddc53c95af", "file": "/m.json", "gyro_serial": "",
    "loaded_s": 1795703642.5, "inputs": ["T", "dTdt"], "domain": {"min": [-24.33, -0.0147], "max": [28.36, 0.0147]},
    "window": {"length_s": 100, "slope": "difference"},
    "provenance": {"tool": "prismcal 0.3.0", "made": "2026-11-26T15:25:55Z",
      "recordings": [{"name": "rec", "blocks": 143, "gaps": 2, "fingerprint": [[1767225601, 8.4], [1767226050, 8.6]],
        "data_quality": {"verdict": "warn", "findings": [
          {"name": "temperature_span", "verdict": "pass", "value": 52.7, "unit": "degC", "warn_below": 25},
          {"name": "length", "verdict": "warn", "value": 143, "unit": "blocks", "warn_below": 200}]}}],
      "training": {"expected": {"improvement_percent": 46.2, "low_percent": 31.4, "high_percent": 58}, "skill": 0.74, "spread": {"nuisance_deg_per_h": 0.000995, "offset_deg_per_h": 0.0021, "noise_deg_per_h": 0.00572, "factor": 2}}}})");
}

TEST(ModelView, AnswersWhatAPersonAsks) {
  EXPECT_EQ(
      model_view(trained()),
      "model        composite T,dTdt (composite)\n"
      "id           d5ddc53c95af\n"
      "file         /m.json\n"
      "in use since 2026-11-26T14:34:02Z\n"
      "gyro         any\n"
      "made         2026-11-26T15:25:55Z by prismcal 0.3.0\n"
      "trained on   rec: 143 means of 100 s (4.0 h), 2026-01-01T00:00:01Z to 2026-01-01T00:07:30Z, 2 gaps\n"
      "             data quality warn: length 143 blocks, expected at least 200\n"
      "range        T -24.33 to 28.36 degC, dTdt -0.0147 to 0.0147 degC/s\n"
      "expect       improvement 46 % (31 to 58 %), each half of the recording explains 74 % of the other's "
      "variation, errors on another day (1 sigma): unexplained drift 0.002, constant offset 0.0042, noise of a mean "
      "0.011 deg/h\n");
}

TEST(ModelView, AModelOfAPaperHasItsSource) {
  json model = trained();
  model["provenance"] = {{"source", "Tao 2019"}, {"note", "train your own"}};
  EXPECT_THAT(model_view(model), HasSubstr("trained on   Tao 2019\n"));
  EXPECT_THAT(model_view(model), HasSubstr("note         train your own\n"));
  EXPECT_EQ(model_view(nullptr), "no model is loaded: rates are not corrected\n");
}

json stability(double raw, double corrected, int blocks) {
  return {{"block_s", 100},
          {"divisor", "N-1"},
          {"raw", {{"sd_deg_per_h", raw}, {"blocks", blocks}}},
          {"corrected", {{"sd_deg_per_h", corrected}, {"blocks", blocks}}},
          {"improvement", 1 - corrected / raw},
          {"noise_deg_per_h", 0.0062}};
}

TEST(StabilityView, SaysWhatTheNumbersMean) {
  EXPECT_THAT(stability_view(stability(0.0069, 0.0068, 40)),
              HasSubstr("raw          0.00690 deg/h (0.00612 to 0.00768) over 40 means\n"));
  EXPECT_THAT(
      stability_view(stability(0.0069, 0.0068, 40)),
      HasSubstr("1.4 %: nothing to correct yet: the raw rate varies little more than the noise, 0.00620 deg/h\n"));
  EXPECT_THAT(stability_view(stability(0.02, 0.01, 10)),
              HasSubstr("50.0 %: too early to judge: fewer than 20 means\n"));
  EXPECT_THAT(stability_view(stability(0.02, 0.01, 40)), HasSubstr("50.0 %: the correction helps\n"));
  EXPECT_THAT(stability_view(stability(0.02, 0.03, 40)), HasSubstr("the correction does not help"));
  EXPECT_THAT(stability_view({{"block_s", 100}, {"improvement", nullptr}}),
              HasSubstr("two corrected means are needed\n"));
}

}  // namespace
}  // namespace prism::prismctl
