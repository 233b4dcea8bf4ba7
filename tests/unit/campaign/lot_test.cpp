// SPDX-License-Identifier: MIT
// Results of a lot: violated limits, outliers, drift, report and installation.
#include "tests/unit/campaign/lot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "compensation/model_text.hpp"
#include "tests/support/shared_files.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/lot.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

Json run(const char* role, const char* recording, const Json& improvement) {
  return {{"role", role},
          {"recording", recording},
          {"trained_on", ""},
          {"measured", {{"improvement_percent", improvement}}}};
}

Task result(const std::string& serial, const std::string& model, double improvement) {
  Task made;
  made.json = {{"task", serial + model},
               {"serial", serial},
               {"axis", ""},
               {"model", model},
               {"level", "baseline"},
               {"outcome", "trained"},
               {"id", ""},
               {"simulated", false},
               {"data_quality", Json::array()},
               {"training", {{"mean_deg_per_h", 1}}},
               {"judged", Json::array({run("repeat", "cycle2", improvement)})}};
  made.json["data_quality"].push_back(
      {{"verdict", "warn"}, {"findings", Json::array({{{"name", "noise"}, {"verdict", "warn"}, {"value", 4}}})}});
  return made;
}

LotLimits limits(double min) {
  LotLimits made;
  made.repeat = {{"improvement_percent", min, {}}};
  return made;
}

TEST(Violations, NameTheLimitAndTheValue) {
  EXPECT_TRUE(find_violations(result("S1", "a", 50), limits(30)).empty());
  EXPECT_THAT(find_violations(result("S1", "a", 20), limits(30)),
              ElementsAre("repeat cycle2: improvement_percent 20, expected at least 30"));
  Task unmeasured = result("S1", "a", 20);
  unmeasured.json["judged"][0]["measured"].clear();
  EXPECT_THAT(find_violations(unmeasured, limits(30)), ElementsAre(HasSubstr("not measured")));
  Task refused = result("S1", "a", 50);
  refused.json = {{"level", "baseline"}, {"outcome", "refused"}, {"why", "no thermometer"}};
  EXPECT_THAT(find_violations(refused, limits(30)), ElementsAre("refused: no thermometer"));
  Task same = result("S1", "a", 50);
  same.json["judged"][0]["trained_on"] = "the model was trained on this file";
  EXPECT_THAT(find_violations(same, limits(30)), ElementsAre(HasSubstr("not a test: the model was trained on this")));
}

TEST(Violations, IncludeDataQuality) {
  LotLimits strict;
  strict.warnings_pass = false;
  EXPECT_THAT(find_violations(result("S1", "a", 50), strict), ElementsAre("data quality: warn (noise), expected pass"));
  LotLimits noise;
  noise.quality = {{"noise", {}, 3.5}, {"quantised", {}, 1}};
  EXPECT_THAT(find_violations(result("S1", "a", 50), noise),
              ElementsAre("data quality: noise 4, expected at most 3.5"));
}

TEST(Lot, ChoosesTheFirstAcceptedModelInTheOrderOfTheFile) {
  Lot lot;
  for (const char* model : {"a", "b"}) {
    lot.tasks.push_back(result("S1", model, 50));
    lot.tasks.push_back(result("S2", model, 50));
  }
  lot.tasks[1].violations = {"limit"};  // S2, a
  const auto best = chosen(lot, {{"a", {}}, {"b", {}}});
  ASSERT_EQ(best.size(), 2u);
  EXPECT_EQ(best.at("S1")->model(), "a");
  EXPECT_EQ(best.at("S2")->model(), "b");
}

Json tables_of(const Lot& lot, const Lot* previous = nullptr) {
  test::Lot files;
  return Json::parse(report::json_text(lot_report(files.file(), lot, previous)))["tables"];
}

TEST(LotReport, FindsAnOutlier) {
  Lot lot;
  for (int i = 0; i < 20; ++i) lot.tasks.push_back(result(fmt::format("S{}", i), "a", 50 + i % 5));
  lot.tasks[7].json["judged"][0]["measured"]["improvement_percent"] = 5;
  const Json rows = tables_of(lot)["spread"]["rows"];
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][1]["text"], "improvement_percent");
  EXPECT_EQ(rows[0][10]["text"], "S7");
  EXPECT_EQ(rows[1][10]["text"], "");
}

TEST(LotReport, FindsDrift) {
  Lot lot;
  lot.tasks = {result("S1", "a", 50), result("S2", "a", 50)};
  Lot later = lot;
  later.tasks[0].json["training"]["mean_deg_per_h"] = 1.25;
  const Json drift = tables_of(later, &lot)["drift"]["rows"];
  ASSERT_EQ(drift.size(), 2u);
  EXPECT_EQ(drift[0][2]["value"], 0.25);
  EXPECT_EQ(drift[1][2]["value"], 0);
  EXPECT_EQ(tables_of(later, &lot)["drift"]["meaning"], "The mean changed most for gyro S1, by 0.25 deg/h.");
}

TEST(LotReport, ComparesWhatBothCampaignsTrainedAndMeasured) {
  Lot before;
  for (const char* gyro : {"S1", "S2", "S3", "S4"}) before.tasks.push_back(result(gyro, "a", 50));
  Lot now = before;
  now.tasks.push_back(result("S1", "b", 50));  // not trained before
  now.tasks[0].json["training"]["mean_deg_per_h"] = nullptr;
  before.tasks[1].json["training"]["mean_deg_per_h"] = nullptr;
  const Json refused = {{"task", ""},          {"serial", "S3"},       {"axis", ""},        {"model", "a"},
                        {"level", "baseline"}, {"outcome", "refused"}, {"why", "too short"}};
  now.tasks[2].json = refused;
  before.tasks[3].json = refused;
  before.tasks[3].json["serial"] = "S4";
  const Json drift = tables_of(now, &before)["drift"];
  ASSERT_EQ(drift["rows"].size(), 2u);
  for (const Json& row : drift["rows"]) EXPECT_EQ(row[2].value("value", Json()), nullptr) << row;
  EXPECT_EQ(tables_of({}, &before)["drift"]["meaning"], "No gyro is in both campaigns.");
}

TEST(LotReport, HasTheMeanOfAllRepeatRuns) {
  Lot lot;
  lot.tasks = {result("S1", "a", 50)};
  Json& judged = lot.tasks[0].json["judged"];
  judged.push_back(run("repeat", "cycle3", 40));
  judged.push_back(run("repeat", "cycle4", nullptr));
  judged.push_back(run("other", "steps", 0));
  const Json row = tables_of(lot)["gyros"]["rows"][0];
  EXPECT_EQ(row[3]["text"], "3");
  EXPECT_EQ(row[6]["value"], 45);
}

TEST(LotReport, HasEveryGyroWithItsLimitAndItsPage) {
  test::Lot files;
  Lot lot;
  lot.tasks = {result("S1", "a", 50), result("S2", "a", 20)};
  lot.tasks[1].violations = {"repeat cycle2: improvement_percent 20, expected at least 30"};
  lot.tasks.push_back({{{"task", ""}, {"serial", "S3"}, {"axis", ""}, {"model", "a"}}, {"out of memory"}});
  const report::Report report = lot_report(files.file(), lot, &lot);
  const auto json = Json::parse(report::json_text(report));
  const Json& rows = json["tables"]["gyros"]["rows"];
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0][0]["link"], "../tasks/S1a/report/report.html");
  EXPECT_EQ(rows[0][2]["text"], "accepted");
  EXPECT_EQ(rows[1][9]["text"], lot.tasks[1].violations[0]);
  EXPECT_EQ(rows[2][9]["text"], "out of memory");
  EXPECT_EQ(json["tables"]["drift"]["rows"].size(), 2u);
  EXPECT_THAT(report.warning, HasSubstr("incomplete"));
  EXPECT_THAT(report.warning, Not(HasSubstr("levels differ")));
}

TEST(LotReport, NamesALotWhoseProcessorLevelsDiffer) {
  test::Lot files;
  Lot lot;
  lot.tasks = {result("S1", "a", 50), result("S2", "a", 20)};
  lot.tasks[0].json["level"] = "x86-64-v3";
  EXPECT_THAT(lot_report(files.file(), lot, nullptr).warning,
              HasSubstr("Processor levels differ: baseline, x86-64-v3"));
}

class InstalledLot : public testing::Test {
 protected:
  /// Stores a model of the gyro as the result of a task.
  void store(const std::string& serial) {
    Task made = result(serial, "a", 50);
    std::string text = test::read_file(fs::path(PRISM_SOURCE_DIR) / "config/models/tao2019-model2.json");
    const auto at = text.find("\"gyro\"");
    if (at != std::string::npos) {
      const auto end = text.find('}', at);
      text.replace(at, end + 1 - at, "\"gyro\": {\"serial\": \"" + serial + "\"}");
    } else {
      text.insert(text.find('{') + 1, "\"gyro\": {\"serial\": \"" + serial + "\"},");
    }
    const std::string folder = task_folder(files_.path("out"), made.id());
    fs::create_directories(folder);
    ASSERT_TRUE(write_text_file(folder + "/model.json", text));
    const auto model = compensation::parse_model(text, "model");
    ASSERT_TRUE(model) << model.error().text();
    made.json["id"] = (*model)->info().id;
    lot_.tasks.push_back(std::move(made));
  }
  Result<InstalledModels> install(const char* folder = "dest", bool keep_others = true) {
    return install_models(files_.file(), lot_, files_.path(folder), keep_others);
  }

  test::Lot files_;
  Lot lot_;
};

TEST_F(InstalledLot, HasAManifestOfChecksumsAndKeepsOtherGyros) {
  store("S1");
  ASSERT_EQ(install()->models, 1u);
  lot_.tasks.clear();
  store("S 2/x");
  const auto second = install();
  ASSERT_TRUE(second) << second.error().text();
  EXPECT_EQ(second->kept, 1u);
  const auto manifest = Json::parse(test::read_file(files_.path("dest/manifest.json")));
  ASSERT_EQ(manifest["models"].size(), 2u);
  EXPECT_EQ(manifest["models"][0]["file"], "S_2_x.json");
  for (const Json& entry : manifest["models"])
    EXPECT_EQ(entry["sha256"], sha256_hex(test::read_file(files_.path("dest/" + entry["file"].get<std::string>()))));
  for (const auto& entry : fs::directory_iterator(files_.path("")))
    EXPECT_FALSE(entry.path().string().ends_with(".new")) << entry.path();
}

TEST_F(InstalledLot, HasOtherGyrosOnlyIfTheyAreKept) {
  store("S1");
  ASSERT_TRUE(install("dest//"));
  lot_.tasks.clear();
  store("S2");
  const auto second = install("dest/", false);
  ASSERT_TRUE(second) << second.error().text();
  EXPECT_EQ(second->models, 1u);
  EXPECT_EQ(second->kept, 0u);
  EXPECT_FALSE(fs::exists(files_.path("dest/S1.json")));
  EXPECT_TRUE(fs::exists(files_.path("dest/S2.json")));
  EXPECT_EQ(Json::parse(test::read_file(files_.path("dest/manifest.json")))["models"].size(), 1u);
}

TEST_F(InstalledLot, IsUnchangedIfAModelIsNotTheEvaluatedOne) {
  store("S1");
  ASSERT_TRUE(install());
  const std::string before = test::read_file(files_.path("dest/manifest.json"));
  store("S2");
  lot_.tasks[1].json["id"] = "0123";
  EXPECT_THAT(install().error().text(), HasSubstr("not the evaluated model"));
  lot_.tasks[1].json["id"] = lot_.tasks[0].json["id"];
  lot_.tasks[1].json["serial"] = "S9";
  EXPECT_THAT(install().error().text(), HasSubstr("expected that of \"S9\""));
  EXPECT_EQ(test::read_file(files_.path("dest/manifest.json")), before);
  EXPECT_FALSE(fs::exists(files_.path("dest/S2.json")));
}

TEST_F(InstalledLot, RejectsAFolderWithOtherFiles) {
  store("S1");
  fs::create_directories(files_.path("dest"));
  std::ofstream(files_.path("dest/letters.txt")) << "dear";
  EXPECT_THAT(install().error().text(), HasSubstr("files but no manifest.json"));
  EXPECT_TRUE(fs::exists(files_.path("dest/letters.txt")));
}

}  // namespace
}  // namespace prism::campaign
