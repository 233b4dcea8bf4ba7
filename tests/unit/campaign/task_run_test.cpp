// SPDX-License-Identifier: MIT
// Running a task: its result is complete or absent, is computed once, and a failure is recorded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.hpp"
#include "tests/unit/campaign/lot.hpp"
#include "tools/prismcal/campaign/lot.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CampaignTask : public testing::Test {
 protected:
  CampaignTask() {
    lot_.gyro("S1");
    plan_ = make_plan(lot_.file(), work_).value();
    EXPECT_TRUE(store_.write_plan(plan_));
    task_ = plan_.tasks.at(0);
  }

  std::size_t unfinished() const {
    return static_cast<std::size_t>(
        std::count_if(fs::directory_iterator(store_.file("tasks")), fs::directory_iterator(),
                      [](const auto& entry) { return entry.path().filename().string().starts_with("."); }));
  }

  Lot lot() const { return read_lot(store_, {}).value(); }

  test::Lot lot_;
  Work work_ = test::quick_work();
  ResultStore store_{lot_.path("out")};
  Plan plan_;
  Task task_;
};

TEST_F(CampaignTask, StoresItsResultUnderItsId) {
  ASSERT_TRUE(run_task(store_, task_, work_));
  EXPECT_TRUE(store_.has_result(task_.id));
  for (const char* name : {"model.json", "result.json", "task.json", "times.json"})
    EXPECT_TRUE(fs::exists(store_.task_folder(task_.id) + "/" + name)) << name;
  EXPECT_EQ(unfinished(), 0u);
  EXPECT_EQ(lot().results.size(), 1u);
  ASSERT_EQ(lot().missing.size(), 1u);
  EXPECT_EQ(lot().missing[0].why, "");  // not run yet
}

TEST_F(CampaignTask, IsSkippedIfItsResultExists) {
  int runs = 0;
  const auto run = work_.run;
  work_.run = [&](const Task& task, const std::string& folder) { return ++runs, run(task, folder); };
  ASSERT_TRUE(run_task(store_, task_, work_));
  ASSERT_TRUE(run_task(store_, task_, work_));
  EXPECT_EQ(runs, 1);
}

// Two programs run one task at the same time: the first result is kept, the second is discarded without an error.
TEST_F(CampaignTask, KeepsTheFirstOfTwoResults) {
  const auto run = work_.run;
  work_.run = [&](const Task& task, const std::string& folder) {
    if (auto other = store_.begin_task(task.id + ".x"); other) {
      std::ofstream(*other + "/first") << "x";
      EXPECT_TRUE(store_.publish_task(*other, task.id));
    }
    return run(task, folder);
  };
  ASSERT_TRUE(run_task(store_, task_, work_));
  EXPECT_TRUE(fs::exists(store_.task_folder(task_.id) + "/first"));
  EXPECT_EQ(unfinished(), 0u);
}

TEST_F(CampaignTask, RecordsAFailureAndCanBeRetried) {
  work_.run = [](const Task&, const std::string&) -> Result<Json> { return make_error("disk", "is full"); };
  EXPECT_FALSE(run_task(store_, task_, work_));
  EXPECT_FALSE(run_task(store_, task_, work_));
  EXPECT_FALSE(store_.has_result(task_.id));
  EXPECT_EQ(unfinished(), 0u);
  EXPECT_EQ(lot().missing.at(0).why, "disk: is full");
  ASSERT_TRUE(run_task(store_, task_, test::quick_work()));
  EXPECT_EQ(lot().missing.size(), 1u);
  EXPECT_EQ(store_.failure(task_.id), "");
}

TEST_F(CampaignTask, StoresARejectionOfTheDataAsAResult) {
  work_.run = [](const Task&, const std::string&) -> Result<Json> {
    return Json{{"outcome", "refused"}, {"why", "no thermometer"}, {"serial", "S1"}, {"axis", "z"},
                {"level", ""},          {"version", "1"}};
  };
  ASSERT_TRUE(run_task(store_, task_, work_));
  ASSERT_EQ(lot().results.size(), 1u);
  EXPECT_TRUE(lot().results[0].refused);
  EXPECT_EQ(lot().results[0].why, "no thermometer");
}

TEST_F(CampaignTask, FailsIfAnInputChangedSinceThePlan) {
  lot_.log("S1/cycle1.csv", "S1", "9\n");
  EXPECT_THAT(run_task(store_, task_, work_).error().text(), HasSubstr("plan again"));
  EXPECT_FALSE(store_.has_result(task_.id));
}

TEST_F(CampaignTask, FailsIfOutOfMemory) {
  work_.run = [](const Task&, const std::string&) -> Result<Json> { throw std::bad_alloc(); };
  EXPECT_THAT(run_task(store_, task_, work_).error().text(), HasSubstr("out of memory"));
  EXPECT_THAT(store_.failure(task_.id), HasSubstr("out of memory"));
}

TEST_F(CampaignTask, LeavesNoUnfinishedResultOfAKilledProcess) {
  fs::create_directories(store_.file(fmt::format("tasks/.{}.host.999999999", task_.id)));
  ASSERT_TRUE(run_task(store_, task_, work_));
  EXPECT_EQ(unfinished(), 0u);
}

TEST_F(CampaignTask, IsReadFromAPlanOfVersion03) {
  ASSERT_TRUE(write_text_file(store_.file("plan.tsv"),
                              fmt::format("task\tgyro\tmodel\tcpu_s\tmemory_mb\n{}\tS1 z\ta\t1.5\t20\n", task_.id)));
  EXPECT_EQ(store_.read_plan().value().at(0).gyro, "S1 z");
}

}  // namespace
}  // namespace prism::campaign
