// SPDX-License-Identifier: MIT
// Running a task: its result is complete or absent, and is computed once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/unit/campaign/lot.hpp"
#include "tools/prismcal/lot.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CampaignTask : public testing::Test {
 protected:
  CampaignTask() {
    lot_.gyro("S1");
    file_ = lot_.file();
    task_ = make_plan(file_).value().tasks.at(0);
  }

  Result<void> run() const { return run_task(file_, task_, work_); }
  bool is_stored() const { return has_result(file_, task_); }
  std::string stored(const std::string& name) const { return task_folder(file_, task_) + "/" + name; }
  std::size_t unfinished() const {
    return static_cast<std::size_t>(
        std::count_if(fs::directory_iterator(file_.folder + "/tasks"), fs::directory_iterator(),
                      [](const auto& entry) { return entry.path().filename().string().starts_with("."); }));
  }

  Lot lot() const { return read_lot(file_).value(); }

  test::Lot lot_;
  Work work_ = test::quick_work;
  LotFile file_;
  Task task_;
};

TEST_F(CampaignTask, StoresItsResultUnderItsId) {
  ASSERT_TRUE(run());
  EXPECT_TRUE(is_stored());
  for (const char* name : {"model.json", "result.json"}) EXPECT_TRUE(fs::exists(stored(name))) << name;
  EXPECT_EQ(unfinished(), 0u);
  ASSERT_TRUE(lot().tasks.at(0).done());
  const Json stored_result = lot().tasks[0].json;
  EXPECT_EQ(stored_result["task"], task_.id());
  EXPECT_EQ(stored_result["inputs"][0]["files"][0]["sha256"], task_.json["inputs"][0]["files"][0]["sha256"]);
  const Json outcome = test::quick_work(task_, lot_.path("")).value();
  for (const auto& [key, value] : outcome.items()) EXPECT_EQ(stored_result[key], value) << key;
  ASSERT_FALSE(lot().tasks.at(1).done());
  EXPECT_TRUE(lot().tasks[1].violations.empty());  // not run yet
}

TEST_F(CampaignTask, IsSkippedIfItsResultExists) {
  int runs = 0;
  work_ = [&](const Task& task, const std::string& folder) { return ++runs, test::quick_work(task, folder); };
  ASSERT_TRUE(run());
  ASSERT_TRUE(run());
  EXPECT_EQ(runs, 1);
}

// Two programs run one task at the same time: the first result is kept, the second is discarded without an error.
TEST_F(CampaignTask, KeepsTheFirstOfTwoResults) {
  work_ = [&](const Task& task, const std::string& folder) {
    fs::create_directories(stored(""));
    std::ofstream(stored("first")) << "x";
    return test::quick_work(task, folder);
  };
  ASSERT_TRUE(run());
  EXPECT_TRUE(fs::exists(stored("first")));
  EXPECT_EQ(unfinished(), 0u);
}

TEST_F(CampaignTask, CanBeRetriedAfterAFailure) {
  work_ = [](const Task&, const std::string&) -> Result<Json> { return make_error("disk", "is full"); };
  EXPECT_FALSE(run());
  EXPECT_FALSE(run());
  EXPECT_FALSE(is_stored());
  EXPECT_EQ(unfinished(), 0u);
  EXPECT_FALSE(lot().tasks.at(0).done());
  work_ = test::quick_work;
  ASSERT_TRUE(run());
  EXPECT_TRUE(lot().tasks.at(0).done());
}

TEST_F(CampaignTask, StoresARejectionOfTheDataAsAResult) {
  work_ = [](const Task&, const std::string&) -> Result<Json> {
    return Json{{"outcome", "refused"}, {"why", "no thermometer"}};
  };
  ASSERT_TRUE(run());
  EXPECT_EQ(lot().tasks.at(0).json["why"], "no thermometer");
  EXPECT_THAT(lot().tasks[0].violations, testing::ElementsAre("no thermometer"));
}

TEST_F(CampaignTask, IsNotReadIfItsResultIsDamaged) {
  ASSERT_TRUE(run());
  const std::string whole = test::read_file(stored("result.json"));
  for (const char* key : {"outcome", "id", "simulated", "data_quality", "training", "judged"}) {
    Json changed = Json::parse(whole);
    changed[key] = 12;
    ASSERT_TRUE(write_text_file(stored("result.json"), changed.dump()));
    EXPECT_THAT(read_lot(file_).error().text(), HasSubstr("expected a result of this version")) << key;
    changed.erase(key);
    ASSERT_TRUE(write_text_file(stored("result.json"), changed.dump()));
    EXPECT_FALSE(read_lot(file_)) << key;
  }
}

TEST_F(CampaignTask, IsAnotherIfAnInputChanged) {
  ASSERT_TRUE(run());
  lot_.log("S1/cycle1.csv", "S1", "9");
  EXPECT_FALSE(lot().tasks.at(0).done());
}

TEST_F(CampaignTask, LeavesNoUnfinishedResultOfAKilledProcess) {
  fs::create_directories(fmt::format("{}/tasks/.{}.host.999999999", file_.folder, task_.id()));
  ASSERT_TRUE(run());
  EXPECT_EQ(unfinished(), 0u);
}

}  // namespace
}  // namespace prism::campaign
