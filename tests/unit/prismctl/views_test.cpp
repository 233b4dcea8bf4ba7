// SPDX-License-Identifier: MIT
// Text of status and bias: means, never a single frame; a disconnected gyro is never good.
#include "tools/prismctl/views.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "tests/support/hostile_texts.hpp"
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

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// A single frame of an angle in pulses is 0 or 20 deg/h, which is not a useful rate.
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

TEST(StatusView, AnnouncesTheNextDeletion) {
  json status = receiving_status();
  const json retention = json::parse(R"({"keep_bytes": 10737418240, "keep_s": 31536000, "next": {"file": "g.csv",
    "rows": 86400, "bytes": 17000000, "why": "age", "in_s": 273600, "time_s": 1795425060}})");
  status["log"] = {{"directory", "d"}, {"rows", 5}, {"dropped", 0}, {"retention", retention}};
  EXPECT_THAT(status_view(status),
              HasSubstr("\ndeletes next g.csv (86400 rows) in 3 d 4 h, 2026-11-23T09:11:00Z: older than 365 days\n"));
  json& next = status["log"]["retention"]["next"];
  next["why"] = "bytes", next["rows"] = 0;
  EXPECT_THAT(status_view(status),
              HasSubstr("\ndeletes next g.csv in 3 d 4 h, 2026-11-23T09:11:00Z: more than 10240.0 MiB\n"));
  next = nullptr;
  EXPECT_THAT(status_view(status), Not(HasSubstr("deletes next")));
  for (const char* axis : {"x", "y"}) status["axes"][axis]["log"]["retention"] = retention;
  status["capture"] = {{"retention", 5}};
  EXPECT_EQ(status_view(status).find("deletes next") == status_view(status).rfind("deletes next"), false);
}

TEST(StatusView, AGyroThatIsGoneHasNoNumber) {
  const std::string text = status_view(gone_status());
  EXPECT_THAT(text, HasSubstr("state        connecting: unplugged (end of file)"));
  EXPECT_THAT(text, HasSubstr("quality      no_data (no current measurement), last data 15 s ago\n"));
  EXPECT_THAT(text, HasSubstr("rate         -\n"));
  EXPECT_THAT(text, HasSubstr("corrected    -\n"));
  EXPECT_THAT(text, Not(HasSubstr("quality      good")));
  EXPECT_THAT(text, Not(HasSubstr("8.4")));
}

// Two lines for each axis: a column for each of four cut words.
TEST(StatusView, FourAxesFitEightyColumns) {
  json status = receiving_status();
  json own = status;
  own["quality"] = "warming+extrapolating+slew_limited";
  own["window"]["mean_rate_deg_per_h"] = -12345.678901;
  own["model"] = {{"name", "composite T,dTdt,U"}, {"kind", "composite"}, {"id", "d5ddc53c95af0123"}};
  for (const char* axis : {"x", "y", "z", "skewed"}) status["axes"][axis] = own;
  const std::string text = values_view(status);
  EXPECT_THAT(text, HasSubstr("  rate deg/h        bias    corrected     T degC       dT/dt      U V        sd\n"
                              "axis skewed  warming+extrapolating+slew_limited (110 of 110 s);\n"
                              "             model composite T,dTdt,U\n"
                              "-12345.67890     0.50000      7.97111     25.000    0.000100   5.3000   0.00700\n"
                              "axis x "));
  EXPECT_THAT(
      bias_view({{"axes",
                  {{"x", {{"quality", "good"}, {"temperature_degc", 25.2}, {"model", "a0e547ce32db04c"}}}, {"y", 1}}}}),
      HasSubstr("axis x       good; model a0e547ce32db\n           -           -            -     25.200 "));
  for (const std::string& line : lines_of(text)) EXPECT_LE(line.size(), 80U) << line;
}

TEST(BiasView, ShowsMeansAndNotOneFrame) {
  const json bias = json::parse(R"({"time_s": 10, "rate_deg_per_h": 20.0, "bias_deg_per_h": 0.5, "sd_deg_per_h": 0.007,
    "corrected_deg_per_h": 19.5, "second_rate_deg_per_h": 8.4, "second_corrected_deg_per_h": 7.9,
    "mean_rate_deg_per_h": 8.47111, "corrected_mean_deg_per_h": 7.97111, "window_s": 100, "warm_s": 110, "full_s": 110,
    "quality": "good", "age_s": 0.1, "model": "a0e547ce32dbb04c"})");
  const std::string text = bias_view({{"axes", {{"z", bias}}}});
  EXPECT_THAT(text, HasSubstr("rate         8.40000 deg/h over 1 s, 8.47111 deg/h over 100 s\n"));
  EXPECT_THAT(text, HasSubstr("corrected    7.90000 deg/h over 1 s, 7.97111 deg/h over 100 s\n"));
  EXPECT_THAT(text, Not(HasSubstr("20.0")));
  EXPECT_THAT(text, Not(HasSubstr("19.5")));
}

TEST(BiasView, ShowsTheOtherInputsOfTheModel) {
  const json bias = json::parse(R"({"temperature_degc": 25, "slope_degc_per_s": 0.0001, "uhfo_v": 5, "inputs": {
    "T": {"value": 25, "unit": "degC"}, "case-T": {"value": 0.41, "unit": "degC"},
    "dcase/dt": {"value": 0.000125, "unit": "degC/s"}, "anode": {"value": null, "unit": "degC"}}})");
  EXPECT_THAT(bias_view({{"axes", {{"z", bias}}}}),
              HasSubstr("temperature  25.000 degC, slope 0.000100 degC/s\n"
                        "UHFO         5.0000 V\n"
                        "model        none\n"
                        "inputs       anode -, case-T 0.410 degC, dcase/dt 0.000125 degC/s\n"));
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

/// `value` with `text` for each string; with `names`, also a member of that name in each object of names.
json with_text(const json& value, const std::string& text) {
  if (value.is_string()) return text;
  if (!value.is_structured()) return value;
  json changed = value;
  for (auto& [key, below] : changed.items()) below = with_text(below, text);
  for (const char* names : {"axes", "sensors", "sensor_lines", "inputs", "provenance"}) {
    if (changed.is_object() && changed.contains(names) && changed[names].is_object())
      changed[names][text] = *changed[names].begin();
  }
  return changed;
}

using View = std::string (*)(const json&);

const std::vector<std::pair<View, json>>& views() {
  static const std::vector<std::pair<View, json>> kViews = [] {
    json status = receiving_status();
    status["gyro_serial"] = "1", status["log"] = {{"directory", "/log"}, {"rows", 1}};
    status["model"] = {{"name", "m"}, {"kind", "k"}, {"id", "1234567890abcdef"}};
    status["sensors"] = {{"case", {{"value", 1}, {"unit", "V"}}}};
    status["sensor_lines"] = {{"logger", {{"state", "receiving"}, {"device", "/d"}, {"frames", "f"}, {"detail", "d"}}}};
    json axes = status;
    axes["axes"] = {{"x", status}};
    const json line = {{"device", "/d"},
                       {"state", "receiving"},
                       {"detail", "why"},
                       {"notes", {"note"}},
                       {"decoder", {{"frames", "f"}}},
                       {"hardware", {{"breaks", 1}}},
                       {"sensor_lines", {{"logger", {{"notes", {"n"}}, {"device", "/e"}, {"state", "s"}}}}}};
    const json model = {{"name", "m"},
                        {"kind", "k"},
                        {"id", "i"},
                        {"file", "/f"},
                        {"gyro_serial", "1"},
                        {"inputs", {"T", "dTdt"}},
                        {"domain", {{"min", {1, 2}}, {"max", {3, 4}}}},
                        {"window", {{"length_s", 100}, {"slope", "fit"}}},
                        {"provenance", {{"by", "me"}, {"recordings", {{{"file", "a"}, {"fingerprint", "b"}}}}}}};
    const json bias = {{"axes", {{"z", {{"time_s", 1}, {"quality", "good"}, {"model", "abc"}}}}}};
    const json stability = {{"block_s", 100}, {"divisor", "n-1"}, {"model", status["model"]}};
    const json event = {{"time_s", 1}, {"severity", "info"}, {"kind", "k"}, {"text", "t"}, {"repeats", 2}};
    return std::vector<std::pair<View, json>>{{status_view, status}, {status_view, axes}, {line_view, line},
                                              {model_view, model},   {bias_view, bias},   {stability_view, stability},
                                              {event_line, event},   {window_line, event}};
  }();
  return kViews;
}

// A text that reaches the terminal as it came could clear the screen, set the window's title, or show a line of its
// own.
TEST(AllViews, NoTextReachesTheTerminalAsASequenceOrALine) {
  for (const std::string& text : test::hostile_texts()) {
    for (std::size_t i = 0; i < views().size(); ++i) {
      SCOPED_TRACE(text.substr(0, 40) + " in view " + std::to_string(i));
      const auto& [view, answer] = views()[i];
      const std::string shown = view(with_text(answer, text)),
                        usual = view(with_text(answer, std::string(printable(text).size(), 'u')));
      std::string flat = shown;
      std::replace(flat.begin(), flat.end(), '\n', ' ');
      EXPECT_TRUE(is_printable(flat));
      if (text.size() > 1000) continue;  // sensors fill lines of 80 columns
      const auto lines = [](const std::string& of) { return static_cast<int>(std::count(of.begin(), of.end(), '\n')); };
      EXPECT_NEAR(lines(shown), lines(usual), 1);
    }
  }
}

// An answer of another type than expected is shown as missing: the rest of the answer is shown.
TEST(AllViews, AnyTypeIsShown) {
  const std::vector<json> others = {nullptr, true, -1, 1e300, "text", json::array({1, "a"}), {{"a", {{"b", 1}}}}};
  for (std::size_t i = 0; i < views().size(); ++i) {
    const auto& [view, answer] = views()[i];
    const json flat = answer.flatten();
    for (const auto& [place, value] : flat.items()) {
      for (json::json_pointer at(place); !at.empty(); at = at.parent_pointer()) {
        for (const json& other : others) {
          json changed = answer;
          changed[at] = other;
          EXPECT_NO_THROW(view(changed)) << "view " << i << ": " << changed;
        }
      }
    }
    for (const json& other : others) EXPECT_NO_THROW(view(other)) << "view " << i << ": " << other;
  }
}

TEST(OnlyAxis, IsPartOfTheResult) {
  const json status = json::parse(R"({"state": "receiving", "log": {"rows": 5},
    "axes": {"z": {"quality": "good", "log": {"retention": {}}}}})");
  EXPECT_EQ(with_only_axis(status), json::parse(R"({"state": "receiving", "axis": "z", "quality": "good",
    "log": {"rows": 5, "retention": {}}})"));
  EXPECT_EQ(with_only_axis(json::parse(R"({"axes": {"z": {"quality": "good"}}})")), json({{"quality", "good"}}));
  EXPECT_EQ(with_only_axis(json::parse(R"({"axes": {"z": [1, 2]}})")), json({1, 2}));
  EXPECT_EQ(with_only_axis(json::parse(R"({"axes": {"z": null}})")), json());
}

TEST(OnlyAxis, LeavesOtherResults) {
  for (const char* text : {R"({"axes": {"x": {"a": 1}, "y": {"a": 2}}})", R"({"axes": ["z"]})", R"({"axes": {}})",
                           R"({"name": "prismd"})", "null", "[1]", "3"})
    EXPECT_EQ(with_only_axis(json::parse(text)), json::parse(text)) << text;
}

TEST(ChosenAxis, LeavesTheOthersOut) {
  json result = json::parse(R"({"axes": {"x": 1, "y": 2}})");
  EXPECT_EQ(choose_axis(result, "w").error().text(), "--axis: found w, expected one of x, y");
  EXPECT_TRUE(choose_axis(result, ""));
  EXPECT_EQ(result["axes"].size(), 2U);
  EXPECT_TRUE(choose_axis(result, "y"));
  EXPECT_EQ(result["axes"], json({{"y", 2}}));
}

TEST(EachAxis, IsNamedIfThereAreSeveral) {
  const auto view = [](const json& own) { return own.dump() + "\n"; };
  EXPECT_EQ(each_axis(json::parse(R"({"axes": {"z": 1}})"), view), "1\n");
  EXPECT_EQ(each_axis(json::parse(R"({"axes": {"x": 1, "y": null}})"), view), "axis x\n1\n\naxis y\nnull\n");
}

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
