// SPDX-License-Identifier: MIT
// The campaign file: parsing, errors, and agreement with its schema.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/schema_validator.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/unit/campaign/lot.hpp"
#include "tools/prismcal/lot.hpp"

namespace prism::campaign {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using TestJson = test::SchemaValidator::Json;
const std::filesystem::path kSource = PRISM_SOURCE_DIR;

// Every key once.
constexpr const char* kAllKeys = R"({
  "$schema": "campaign.schema.json", "name": "lot", "asked_by": "J. Smith",
  "recordings": [{"role": "train", "paths": "lot/*/a", "serial": "*"}, {"role": "repeat", "paths": ["lot/*/b", "/x/c"]}],
  "models": {"kernel": {"method": "ir-lssvm", "folds": 10, "no-earth-rate": true, "force": false, "inputs": ["T", "dTdt"]}},
  "judging": {"max-bias": 50}, "reading": {"decimal": ","},
  "limits": {"data_quality": {"verdict": "pass"},
             "repeat": {"improvement_percent": {"min": 30}}, "other": {"rms_deg_per_h": {"max": 1}}},
  "output": {"folder": "out", "reports": false}
})";

TestJson load(const std::filesystem::path& path) { return TestJson::parse(test::read_file(path), nullptr, true, true); }
bool accepts(const TestJson& json) { return parse_lot_file(json.dump(), "/lab/lot.json").has_value(); }
std::string error_of(const std::string& pointer, const TestJson& value) {
  TestJson json = TestJson::parse(kAllKeys);
  json[TestJson::json_pointer(pointer)] = value;
  const auto file = parse_lot_file(json.dump(), "/lab/lot.json");
  return file ? "accepted" : file.error().text();
}

TEST(CampaignFile, ResolvesPathsRelativeToItself) {
  const LotFile file = parse_lot_file(kAllKeys, "/lab/lot.json").value();
  EXPECT_EQ(file.name, "lot");
  EXPECT_EQ(file.recordings.at(1).pattern, "/lab/lot/*/b");
  EXPECT_EQ(file.recordings.at(2).pattern, "/x/c");
  EXPECT_EQ(file.recordings.at(2).role, "repeat");
  EXPECT_THAT(file.models.at(0).words,
              ElementsAre("--decimal=,", "--method=ir-lssvm", "--folds=10", "--no-earth-rate", "--inputs=T,dTdt"));
  EXPECT_THAT(file.judging, ElementsAre("--decimal=,", "--max-bias=50"));
  EXPECT_FALSE(file.limits.warnings_pass);
  EXPECT_EQ(file.limits.repeat.at(0).min, 30);
  EXPECT_EQ(file.limits.other.at(0).quantity, "rms_deg_per_h");
  EXPECT_EQ(file.folder, "/lab/out");
  EXPECT_FALSE(file.reports);
}

TEST(CampaignFile, HasDefaults) {
  const LotFile file = parse_lot_file(R"({"models": {"m": {}}, "recordings": [{"role": "train", "paths": "a"},
                                               {"role": "repeat", "paths": "b"}]})",
                                      "/lab/winter.json")
                           .value();
  EXPECT_EQ(file.name, "winter");
  EXPECT_EQ(file.folder, "/lab/winter.campaign");
  EXPECT_TRUE(file.reports);
  EXPECT_TRUE(file.limits.warnings_pass);
  EXPECT_TRUE(file.models.at(0).words.empty());
}

TEST(CampaignFile, OfVersion03IsReadWithoutSlurmButNotWithALevel) {
  TestJson json = TestJson::parse(kAllKeys);
  json["slurm"] = {{"options", {"--time=1:00:00"}}};
  const auto file = parse_lot_file(json.dump(), "/lab/lot.json");
  ASSERT_TRUE(file) << file.error().text();
  EXPECT_THAT(file->warnings, ElementsAre(HasSubstr("/lab/lot.json:/slurm: removed in prism 0.4")));
  EXPECT_THAT(error_of("/level", "baseline"), HasSubstr("/level: removed in prism 0.4"));
  EXPECT_THAT(error_of("/limits/data_quality/findings", {{"noise", {{"max", 3}}}}), HasSubstr("removed in prism 0.4"));
  json["previous"] = "old";
  EXPECT_EQ(parse_lot_file(json.dump(), "/lab/lot.json").value().warnings.size(), 2u);
}

TEST(CampaignFile, NamesNoFileThatIsNotAnInputOfATask) {
  for (const char* at : {"/models/kernel/prior", "/judging/fallback", "/reading/config", "/models/kernel/serial"})
    EXPECT_THAT(error_of(at, "x"), HasSubstr(std::string(at) + ": found it, expected no")) << at;
}

TEST(CampaignSchema, AcceptsTheExamples) {
  const test::SchemaValidator validator(load(kSource / "config/campaign.schema.json"));
  for (const TestJson& json : {TestJson::parse(kAllKeys), load(kSource / "config/examples/campaign.json")}) {
    EXPECT_TRUE(validator.accepts(json));
    EXPECT_TRUE(accepts(json)) << parse_lot_file(json.dump(), "x").error().text();
  }
}

void walk(const TestJson& json, const TestJson::json_pointer& at,
          const std::function<void(const TestJson::json_pointer&)>& visit) {
  if (!at.empty()) visit(at);
  if (!json.is_object()) return;
  for (const auto& [key, value] : json.items()) walk(value, at / key, visit);
}

// Replaces each value by one of each type, and adds an unknown key to each object.
TEST(CampaignSchema, AcceptsWhatTheReaderAccepts) {
  const test::SchemaValidator validator(load(kSource / "config/campaign.schema.json"));
  const TestJson valid = TestJson::parse(kAllKeys);
  const TestJson values =
      TestJson::array({nullptr, -1, 3, 0.25, "7", true, TestJson::array({nullptr}), TestJson{{"what", nullptr}}});
  int rejected = 0;
  walk(valid, TestJson::json_pointer(), [&](const TestJson::json_pointer& at) {
    if (at.to_string() == "/$schema") return;
    for (const TestJson& value : values) {
      TestJson changed = valid;
      changed[at] = value;
      const bool read = accepts(changed);
      rejected += !read;
      EXPECT_FALSE(read && !validator.accepts(changed)) << at.to_string() << " = " << value.dump();
    }
    if (!valid.at(at).is_object() || at.to_string().starts_with("/models") || at.to_string() == "/judging" ||
        at.to_string() == "/reading")
      return;
    TestJson more = valid;
    more[at]["an unknown key"] = 1;
    EXPECT_FALSE(accepts(more)) << at.to_string();
    EXPECT_FALSE(validator.accepts(more)) << at.to_string();
  });
  EXPECT_GT(rejected, 100);
}

class CampaignPlan : public testing::Test {
 protected:
  Lot plan() { return make_plan(file_ ? *file_ : lot_.file()).value(); }
  static std::vector<std::string> ids(const Lot& plan) {
    std::vector<std::string> found;
    for (const Task& task : plan.tasks) found.push_back(task.id());
    return found;
  }

  test::Lot lot_;
  std::optional<LotFile> file_;
};

TEST_F(CampaignPlan, HasATaskForEachGyroAndModel) {
  lot_.gyro("S2");
  lot_.gyro("S1");
  const Lot made = plan();
  ASSERT_EQ(made.tasks.size(), 4u);
  EXPECT_EQ(made.tasks[0].serial(), "S1");
  EXPECT_EQ(made.tasks[0].axis(), "z");
  EXPECT_EQ(made.tasks[1].model(), "b");
  EXPECT_EQ(made.tasks[2].serial(), "S2");
  EXPECT_THAT(made.tasks[0].paths(kTrain), ElementsAre(lot_.path("S1/cycle1.csv")));
}

TEST_F(CampaignPlan, AChangedFileChangesTheIdsOfItsTasksOnly) {
  lot_.gyro("S1");
  lot_.gyro("S2");
  const auto before = ids(plan());
  lot_.log("S2/cycle2.csv", "S2", "3");  // same size, other contents
  const auto after = ids(plan());
  EXPECT_EQ(after[0], before[0]);
  EXPECT_EQ(after[1], before[1]);
  EXPECT_NE(after[2], before[2]);
  EXPECT_NE(after[3], before[3]);
}

TEST_F(CampaignPlan, HasIdsThatDependOnAllInputsOfTheResult) {
  lot_.gyro("S1");
  const auto first = ids(plan());
  const auto changed = [&](const std::function<void()>& change) {
    file_ = lot_.file();
    change();
    const auto now = ids(plan());
    return now.at(0) != first.at(0);
  };
  EXPECT_FALSE(changed([] {}));
  EXPECT_TRUE(changed([&] { file_->version = "0.1"; }));
  EXPECT_TRUE(changed([&] { file_->models[0].words = {"--folds=6"}; }));
  EXPECT_TRUE(changed([&] { file_->judging = {"--max-bias=1"}; }));
  EXPECT_TRUE(changed([&] { file_->reports = false; }));
  EXPECT_FALSE(changed([&] { file_->limits.repeat = {{"rms_deg_per_h", {}, 1}}; }));  // applied later
  EXPECT_FALSE(changed([&] { file_->models[0].name = "c"; }));
}

TEST_F(CampaignPlan, ListsGyrosWithoutRoleOrSerialNumber) {
  lot_.gyro("S1");
  lot_.log("S2/cycle1.csv", "S2");
  lot_.log("S3/cycle1.csv", "unknown");
  const Lot made = plan();
  EXPECT_EQ(made.tasks.size(), 2u);
  ASSERT_EQ(made.left_out.size(), 2u);
  EXPECT_THAT(made.left_out[0].second, HasSubstr("found no gyro_serial"));
  EXPECT_EQ(made.left_out[1].first, "S2 z");
  EXPECT_THAT(made.left_out[1].second, HasSubstr("role repeat"));
}

// Tables of other programs name no gyro.
TEST_F(CampaignPlan, TakesSerialNumbersFromThePattern) {
  lot_.log("S1/cycle1.csv", "unknown");
  lot_.log("S2/cycle1.csv", "unknown");
  lot_.log("repeat-S1-2.csv", "unknown", "2");
  file_ = lot_.file();
  file_->recordings[0].serial = "*";
  file_->recordings[1] = {kRepeat, lot_.path("repeat-*-2.csv"), "*"};
  const Lot made = plan();
  ASSERT_EQ(made.tasks.size(), 2u);
  EXPECT_EQ(made.tasks[0].serial(), "S1");
  EXPECT_THAT(made.tasks[0].paths(kRepeat), ElementsAre(lot_.path("repeat-S1-2.csv")));
  EXPECT_EQ(made.left_out.at(0).first, "S2");
  for (const char* pattern : {"x/S?/*/c.csv", "x/S*/c*.csv", "x/S1/c.csv"})
    EXPECT_THAT(error_of("/recordings/0/paths", pattern), HasSubstr("with one * and no other wildcard")) << pattern;
}

TEST_F(CampaignPlan, FailsIfAPatternMatchesNoFile) {
  EXPECT_THAT(make_plan(lot_.file()).error().text(), HasSubstr("matches no file"));
}

TEST_F(CampaignPlan, OfOneTaskHasItsId) {
  lot_.gyro("S1");
  lot_.gyro("S2");
  const auto all = ids(plan());
  const Lot one = make_plan(lot_.file(), "S1 z, b").value();
  EXPECT_THAT(ids(one), ElementsAre(all[1]));
  EXPECT_THAT(make_plan(lot_.file(), "S9 z, b").error().text(), HasSubstr("not a task of"));
}

}  // namespace
}  // namespace prism::campaign
