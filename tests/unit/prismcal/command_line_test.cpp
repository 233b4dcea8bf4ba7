// SPDX-License-Identifier: MIT
// Number options reject values outside their range and "nan", for which a range check alone does not fail.
#include "tools/command_line.hpp"

#include <gtest/gtest.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <vector>

#include "tools/prismcal/commands/common_options.hpp"
#include "tools/prismcal/commands/method_options.hpp"
#include "tools/prismcal/commands/recording_options.hpp"

namespace prism::prismcal {
namespace {

TEST(NumberCheck, RejectsValuesOutsideItsRangeAndNonNumbers) {
  const CLI::Validator angle = tools::within(-90, 90);
  for (const char* good : {"-90", "0", "45.5", "9e1"}) EXPECT_EQ(angle(good), "") << good;
  for (const char* bad : {"nan", "-nan", "inf", "91", "", "1x"}) EXPECT_NE(angle(bad), "") << bad;
  EXPECT_EQ(angle("nan"), "found \"nan\", expected a number within -90 to 90");
  EXPECT_EQ(tools::positive()("0"), "found \"0\", expected a number above 0");
  EXPECT_EQ(tools::not_negative()("0"), "");
  EXPECT_NE(tools::not_negative()("-1e-9"), "");
}

// Options are found by their type.
TEST(NumberCheck, AllNumberOptionsOfPrismcalRejectNan) {
  CLI::App app("prismcal");
  commands::MethodOptions method;
  recordings::TrainingSetOptions recordings;
  commands::CommonOptions common;
  commands::add_method_options(*app.add_subcommand("method"), method);
  commands::add_training_set_options(*app.add_subcommand("recordings"), recordings);
  commands::add_common_options(*app.add_subcommand("common"), common);
  int numbers = 0;
  for (const CLI::App* command : app.get_subcommands({})) {
    for (const CLI::Option* option : command->get_options()) {
      if (option->get_type_name().find("FLOAT") == std::string::npos) continue;
      ++numbers;
      EXPECT_THROW(const_cast<CLI::App*>(command)->parse(std::vector<std::string>{"nan", option->get_name()}),
                   CLI::ParseError)
          << option->get_name();
    }
  }
  EXPECT_GT(numbers, 12);
}

}  // namespace
}  // namespace prism::prismcal
