// SPDX-License-Identifier: MIT
// Planning: one task per gyro and model, and ids that depend on exactly what the result depends on.
#include "tools/prismcal/campaign/plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/campaign/lot.hpp"

namespace prism::campaign {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class CampaignPlan : public testing::Test {
 protected:
  Plan plan() { return make_plan(file_ ? *file_ : lot_.file(), work_).value(); }
  static std::vector<std::string> ids(const Plan& plan) {
    std::vector<std::string> found;
    for (const Task& task : plan.tasks) found.push_back(task.id);
    return found;
  }

  test::Lot lot_;
  Work work_ = test::quick_work();
  std::optional<CampaignFile> file_;
};

TEST_F(CampaignPlan, HasATaskForEachGyroAndModel) {
  lot_.gyro("S2");
  lot_.gyro("S1");
  const Plan made = plan();
  ASSERT_EQ(made.tasks.size(), 4u);
  EXPECT_EQ(made.gyros, 2u);
  EXPECT_EQ(made.tasks[0].serial, "S1");
  EXPECT_EQ(made.tasks[0].axis, "z");
  EXPECT_EQ(made.tasks[1].model.name, "b");
  EXPECT_EQ(made.tasks[2].serial, "S2");
  EXPECT_THAT(made.tasks[0].paths(Role::kTrain), ElementsAre(lot_.path("S1/cycle1.csv")));
}

TEST_F(CampaignPlan, AChangedFileChangesTheIdsOfItsTasksOnly) {
  lot_.gyro("S1");
  lot_.gyro("S2");
  const auto before = ids(plan());
  lot_.log("S2/cycle2.csv", "S2", "3\n");  // same size, other contents
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
    work_ = test::quick_work();
    return now.at(0) != first.at(0);
  };
  EXPECT_FALSE(changed([] {}));
  EXPECT_TRUE(changed([&] { work_.version = "2"; }));
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
  const Plan made = plan();
  EXPECT_EQ(made.gyros, 1u);
  ASSERT_EQ(made.left_out.size(), 2u);
  EXPECT_THAT(made.left_out[0].why, HasSubstr("found no gyro_serial"));
  EXPECT_EQ(made.left_out[1].what, "S2 z");
  EXPECT_THAT(made.left_out[1].why, HasSubstr("role repeat"));
}

TEST_F(CampaignPlan, FailsIfAPatternMatchesNoFile) {
  EXPECT_THAT(make_plan(lot_.file(), work_).error().text(), HasSubstr("matches no file"));
}

TEST_F(CampaignPlan, ReadsATaskBackFromItsLine) {
  lot_.gyro("S 1, \"x\"");
  const Task task = plan().tasks.at(0);
  const Task read = parse_task(task_json(task).dump(), "t").value();
  EXPECT_EQ(task_json(read), task_json(task));
}

}  // namespace
}  // namespace prism::campaign
