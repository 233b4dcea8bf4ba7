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
               {"outcome", "trained"},
               {"id", ""},
               {"simulated", false},
               {"data_quality", Json::array()},
               {"training", {{"mean_deg_per_h", 1}}},
               {"judged", Json::array({run("repeat", "cycle2", improvement)})}};
  made.json["data_quality"].push_back("warn (noise 4)");
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
  refused.json = {{"outcome", "refused"}, {"why", "no thermometer"}};
  EXPECT_THAT(find_violations(refused, limits(30)), ElementsAre("no thermometer"));
  Task same = result("S1", "a", 50);
  same.json["judged"][0]["trained_on"] = "the model was trained on this file";
  EXPECT_THAT(find_violations(same, limits(30)), ElementsAre(HasSubstr("not a test: the model was trained on this")));
}

TEST(Violations, IncludeDataQuality) {
  LotLimits strict;
  strict.warnings_pass = false;
  EXPECT_THAT(find_violations(result("S1", "a", 50), strict),
              ElementsAre("data quality: warn (noise 4), expected pass"));
  Task forced = result("S1", "a", 50);
  forced.json["data_quality"][0] = "refuse (moved 1)";
  EXPECT_THAT(find_violations(forced, LotLimits()), ElementsAre("data quality: refuse (moved 1), expected warn"));
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

Json tables_of(const Lot& lot) {
  test::Lot files;
  return Json::parse(report::json_text(lot_report(files.file(), lot)))["tables"];
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
  lot.tasks.push_back({{{"task", ""}, {"serial", "S3"}, {"axis", ""}, {"model", "a"}}});
  const report::Report report = lot_report(files.file(), lot);
  const auto json = Json::parse(report::json_text(report));
  const Json& rows = json["tables"]["gyros"]["rows"];
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0][0]["link"], "../tasks/S1a/report/report.html");
  EXPECT_EQ(rows[0][2]["text"], "accepted");
  EXPECT_EQ(rows[0][9]["value"], 1);
  EXPECT_EQ(rows[1][10]["text"], lot.tasks[1].violations[0]);
  EXPECT_EQ(rows[2][2]["text"], "to do");
  EXPECT_THAT(report.warning, HasSubstr("incomplete"));
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
    const std::string folder = task_folder(files_.file(), made);
    fs::create_directories(folder);
    ASSERT_TRUE(write_text_file(folder + "/model.json", text));
    const auto model = compensation::parse_model(text, "model");
    ASSERT_TRUE(model) << model.error().text();
    made.json["id"] = (*model)->info().id;
    lot_.tasks.push_back(std::move(made));
  }
  Result<std::size_t> install(const char* folder = "dest") {
    return install_models(files_.file(), lot_, files_.path(folder));
  }

  test::Lot files_;
  Lot lot_;
};

TEST_F(InstalledLot, HasAManifestOfChecksumsAndKeepsOtherGyros) {
  store("S1");
  ASSERT_EQ(install("dest//").value(), 1u);
  lot_.tasks.clear();
  store("S 2/x");
  const auto second = install();
  ASSERT_TRUE(second) << second.error().text();
  const auto manifest = Json::parse(test::read_file(files_.path("dest/manifest.json")));
  ASSERT_EQ(manifest["models"].size(), 2u);
  EXPECT_EQ(manifest["models"][0]["file"], "S_2_x.json");
  for (const Json& entry : manifest["models"])
    EXPECT_EQ(entry["sha256"], sha256_hex(test::read_file(files_.path("dest/" + entry["file"].get<std::string>()))));
  for (const auto& entry : fs::directory_iterator(files_.path("")))
    EXPECT_FALSE(entry.path().string().ends_with(".new")) << entry.path();
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
  EXPECT_THAT(install().error().text(), HasSubstr("found no manifest.json of installed models"));
  EXPECT_TRUE(fs::exists(files_.path("dest/letters.txt")));
}

}  // namespace
}  // namespace prism::campaign
