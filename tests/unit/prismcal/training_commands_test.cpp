// SPDX-License-Identifier: MIT
// The commands train, design and verify: exit codes, text output and JSON.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "base/file.hpp"
#include "compensation/compensated_text.hpp"
#include "compensation/compensation_engine.hpp"
#include "compensation/model_text.hpp"
#include "tests/support/collected.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/design/stated_gyro.hpp"
#include "tests/unit/prismcal/simulated_day.hpp"
#include "tools/command_line.hpp"
#include "tools/prismcal/commands.hpp"
#include "tools/prismcal/common_options.hpp"
#include "tools/prismcal/method_options.hpp"
#include "tools/prismcal/recording.hpp"

namespace prism::commands {
namespace {

namespace fs = std::filesystem;

struct Prismcal : testing::Test {
  std::string path(const std::string& name) const { return folder_.file(name); }
  void write(const std::string& name, const std::string& text) { ASSERT_TRUE(write_text_file(path(name), text)); }

  // Runs a command line; its output is in out_ and err_.
  int run(const std::string& line) {
    CLI::App app("prismcal");
    int code = 0;
    for (const auto add : {add_train_command, add_fit_command, add_cv_command, add_predict_command, add_design_command,
                           add_verify_command})
      add(app, code);
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    try {
      app.parse(line);
    } catch (const CLI::ParseError& error) {
      code = 64;
    }
    out_ = testing::internal::GetCapturedStdout();
    err_ = testing::internal::GetCapturedStderr();
    return code;
  }

  void run_well(const std::string& line) { ASSERT_EQ(run(line), 0) << err_; }

  const test::TemporaryFolder folder_;
  std::string out_, err_;
};

Result<std::vector<double>> column_of(const std::string& path, const std::string& name) {
  auto table = tables::PlainTable::open(path, {});
  if (!table) return tl::unexpected<Error>(table.error());
  const auto index = table->find(name);
  if (!index) return tl::unexpected<Error>(index.error());
  if (auto good = table->select({{*index}, {}}); !good) return tl::unexpected<Error>(good.error());
  std::vector<double> values;
  for (tables::Row row; table->next(row).value_or(false);) values.push_back(row.values[0]);
  return values;
}

TEST_F(Prismcal, FitAndPredictMatchTheReference) {
  const fs::path dir = test::golden_dir("sinc150");
  run_well("fit " + (dir / "train.csv").string() +
           " --inputs x1 --target y --normalise none --weight huber --c 10 --sigma2 0.5 --beta 1.345 --out " +
           path("m.json") + " --diagnostics " + path("d.csv") + " --json");
  const auto summary = nlohmann::json::parse(out_);
  EXPECT_EQ(summary["reweighting"]["solves"], 11);
  EXPECT_EQ(summary["beta"], 1.345);
  run_well("predict " + path("m.json") + " " + (dir / "test.csv").string() + " --out " + path("p.csv"));
  const auto found = column_of(path("p.csv"), "prediction"), expected = column_of(dir / "A_test.csv", "pred_huber");
  ASSERT_TRUE(found && expected);
  for (std::size_t i = 0; i < found->size(); ++i) EXPECT_NEAR((*found)[i], (*expected)[i], 1e-9);
  const auto alpha = column_of(path("d.csv"), "alpha"), wanted = column_of(dir / "A_train.csv", "huber_alpha"),
             sample = column_of(dir / "A_train.csv", "i");
  ASSERT_TRUE(alpha && wanted && sample);
  for (std::size_t k = 0; k < wanted->size(); ++k)
    EXPECT_NEAR(alpha->at(static_cast<std::size_t>((*sample)[k]) - 1), (*wanted)[k], 1e-9);
}

TEST_F(Prismcal, CvPrintsTheCostOfEachFold) {
  const fs::path dir = test::golden_dir("sinc150");
  const auto expected = nlohmann::json::parse(test::read_file(dir / "A.json"));
  run_well("cv " + (dir / "train.csv").string() +
           " --inputs x1 --target y --normalise none --fold-column fold --weight hampel --c 10 --sigma2 0.5 --json");
  const auto found = nlohmann::json::parse(out_);
  EXPECT_NEAR(found["unweighted"]["mse"], expected["unweighted"]["cv_mse"], 1e-7);
  EXPECT_NEAR(found["mae"], expected["robust"]["hampel"]["rcv10"]["mae_30iter"], 1e-9);
  EXPECT_EQ(found["weighted"]["fold_mae"].size(), 10u);
}

TEST_F(Prismcal, StepwisePrintsCoefficientsAndPath) {
  write("t.csv", "a,b,y\n1,5,2.1\n2,3,4.0\n3,8,6.1\n4,1,8.0\n5,9,9.9\n6,2,12.1\n7,7,14.0\n");
  run_well("fit " + path("t.csv") + " --inputs a,b --target y --method stepwise --start none --json");
  const auto found = nlohmann::json::parse(out_);
  EXPECT_NEAR(found["coefficients"]["a"], 2, 0.05);
  EXPECT_FALSE(found["coefficients"].contains("b"));
  EXPECT_EQ(found["path"][1]["action"], "add");
  EXPECT_EQ(found["path"][1]["term"], "a");
}

TEST_F(Prismcal, ErrorsAreOneLineWithFileAndLine) {
  write("t.csv", "a,y\n1,2\n# a remark\n2,three\n");
  EXPECT_EQ(run("fit " + path("t.csv") + " --inputs a --target y"), 1);
  EXPECT_EQ(err_,
            "prismcal: " + path("t.csv") +
                ":4: column y: found \"three\", expected a number; prism-import reads tables of other programs\n");
  EXPECT_EQ(run("fit " + path("t.csv") + " --inputs a,z --target y"), 1);
  EXPECT_EQ(err_,
            "prismcal: " + path("t.csv") + ": found no column \"z\", expected a number from 1 to 2 or one of a, y\n");
  EXPECT_EQ(run("fit " + path("t.csv") + " --inputs a --target y --method magic"), 64);
  write("r.csv", "a,y\n1,2,3\n");
  EXPECT_EQ(run("fit " + path("r.csv") + " --inputs a --target y"), 1);
  EXPECT_EQ(
      err_,
      "prismcal: " + path("r.csv") +
          ":2: found 3 fields, expected 2 as in the names of line 1; prism-import reads tables of other programs\n");
}

// Three hours at 1 Hz with a bias that depends on T, in other units than prism's.
std::string mapped_csv() {
  std::string text = "t_ms,x_dps,temp_K\n";
  for (int i = 1; i <= 10800; ++i) {
    const double t = 20 + 15 * std::sin(i / 2000.0), bias = 0.5 + 0.01 * t + 0.001 * std::sin(i * 12.9898);
    text += fmt::format("{},{:.12f},{:.6f}\n", i * 1000LL, (bias + 3) / 3600, t + 273.15);
  }
  return text;
}

TEST_F(Prismcal, TrainsAUsableModelOnAMappedCsv) {
  write("mapped.csv", mapped_csv());
  run_well("train " + path("mapped.csv") +
           " --map rate=x_dps:deg/s,temperature=temp_K:K,time=t_ms:ms --inputs T,dTdt --weight huber --c 100 "
           "--sigma2 1 --no-earth-rate --serial X1 --out " +
           path("m.json") + " --quiet");
  const auto model = compensation::parse_model(test::read_file(path("m.json")), "m.json");
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_TRUE(out_.starts_with("ready: explains 100 % of held-out variation, expected improvement ")) << out_;
  EXPECT_EQ((*model)->info().gyro_serial, "X1");
  EXPECT_NEAR((*model)->predict(std::vector{20.0, 0.0}).bias_deg_per_h, 3.7, 0.01);
  compensation::CompensationEngine engine;
  EXPECT_TRUE(engine.use(*model, nullptr));
  const auto provenance = nlohmann::json::parse((*model)->info().provenance_json);
  EXPECT_EQ(provenance["recordings"][0]["files"][0]["sha256"].get<std::string>().size(), 64u);
}

TEST_F(Prismcal, RejectsAModelOfATableInTheEngine) {
  write("t.csv", "T,y\n1,1\n2,2.1\n3,2.9\n4,4.2\n5,5\n");
  run_well("fit " + path("t.csv") + " --inputs T --target y --method lssvm --c 10 --sigma2 1 --out " + path("m.json"));
  const auto model = compensation::parse_model(test::read_file(path("m.json")), "m.json");
  ASSERT_TRUE(model) << model.error().text();
  compensation::CompensationEngine engine;
  EXPECT_FALSE(engine.use(*model, nullptr));
}

TEST_F(Prismcal, RejectsAMapWithAnUnknownUnit) {
  write("mapped.csv", "a,b\n1,2\n");
  recordings::SourceOptions options;
  options.map = {"rate=a:furlong"};
  const auto source = test::collected(path("mapped.csv"), options);
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().text().find('\n'), std::string::npos);
  EXPECT_NE(source.error().text().find("rate in deg/h"), std::string::npos);
}

// Raw counts with the scale factor of a data sheet; columns by number.
TEST_F(Prismcal, ScalesAndShiftsMappedColumns) {
  write("raw.csv", "t,Gx,Traw\n1,100,340\n2,120,680\n3,140,0\n");
  recordings::SourceOptions options;
  options.map = {"rate=Gx:deg/s*0.061-1.2", "temperature=3:degC*2.5e-3+36.5", "time=1:s"};
  const auto source = test::collected(path("raw.csv"), options);
  ASSERT_TRUE(source) << source.error().text();
  ASSERT_GE(source->second_means.size(), 2u);
  EXPECT_NEAR(source->second_means[0].rate_deg_per_h, (100 * 0.061 - 1.2) * 3600, 1e-6);
  EXPECT_NEAR(source->second_means[0].temperature_degc, 340 * 2.5e-3 + 36.5, 1e-9);
  for (const char* wrong : {"rate=Gx:deg/s*", "rate=Gx:deg/s*0", "rate=Gx:deg/s*x", "rate=Gx:deg/s*2+",
                            "rate=Gx:deg/s+1*2", "rate=Gx:deg/s*1e999", "rate=9:deg/s", "rate=Gx"}) {
    options.map = {wrong, "time=1:s"};
    const auto rejected = test::collected(path("raw.csv"), options);
    ASSERT_FALSE(rejected) << wrong;
    EXPECT_NE(rejected.error().text().find("expected"), std::string::npos) << rejected.error().text();
  }
  options.map.clear();
  EXPECT_NE(test::collected(path("raw.csv"), options).error().text().find("--map"), std::string::npos);
}

struct DesignCommand : Prismcal {
  int design(const std::string& options) { return run("design " + options + " --out " + path("cycle.csv")); }
  int design_model(const std::string& options) {
    const auto model = design::model_of(design::gyro(), design::cycle(0));
    EXPECT_TRUE(write_text_file(path("m.json"), compensation::format_model(*model)));
    return design(path("m.json") + " --domain 'T=-30:50, dTdt=-0.5:0.5 degC/min' " + options);
  }
};

TEST_F(DesignCommand, WritesSetPointsWithinTheLimits) {
  ASSERT_EQ(design_model("--coldest -35 --hottest 55 --rate 2 --hours 4"), 0) << err_;
  const auto text = read_text_file(path("cycle.csv"));
  ASSERT_TRUE(text);
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "time_s,temperature_degc");
  double before_s = 0, before_degc = 25;
  while (std::getline(lines, line)) {
    double time_s = 0, degc = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf", &time_s, &degc), 2) << line;
    EXPECT_GE(degc, -35);
    EXPECT_LE(degc, 55);
    EXPECT_LE(std::abs(degc - before_degc), 2.0 / 60 * (time_s - before_s) + 0.1) << line;
    before_s = time_s;
    before_degc = degc;
  }
  EXPECT_NEAR(before_s, 4 * 3600, 60);
  EXPECT_EQ(out_.find("\\x"), std::string::npos) << out_;
  for (const char* expected : {"next: designed", "next: the paper's cycle", "next: slow ramp", "next: staircase",
                               "recording 1", "The designed profile takes ", "--thermal-lag, --self-heating"})
    EXPECT_NE(out_.find(expected), std::string::npos) << expected << "\n" << out_;
  EXPECT_EQ(err_, "");
}

TEST_F(DesignCommand, NamesWhatIsMissing) {
  EXPECT_EQ(design("--domain T=-30:60"), 1);
  EXPECT_EQ(err_, "prismcal: design: found no model and no --prior, expected one of them\n");
  EXPECT_EQ(design_model("--coldest 30 --hottest 40"), 1);
  EXPECT_EQ(err_, "prismcal: --start: found 25 degC, expected --coldest 30 or above, and --hottest 40 or below\n");
  EXPECT_EQ(design_model("--hours 0.5 --rate 0.1"), 1);
  EXPECT_EQ(err_.substr(0, 45), "prismcal: --hours: found 0.5 h, too short for");
  EXPECT_EQ(design("m.json --domain T=-40:600"), 1);
  EXPECT_EQ(err_, "prismcal: --domain: T: found -40:600, expected limits within -200 to 300 degC\n");
  EXPECT_EQ(design("m.json --domain 'T=233:333 K'"), 1);
  EXPECT_EQ(err_, "prismcal: --domain: T: found unit \"K\", expected degC\n");
  const std::string model = path("line.json");
  ASSERT_TRUE(write_text_file(model, compensation::format_model(*test::linear_model(1e-4))));
  EXPECT_EQ(design(model + " --domain T=-30:60"), 1);
  EXPECT_EQ(err_, "prismcal: line: found a model of type polynomial, expected composite, made by prismcal train\n");
}

using testing::HasSubstr;

struct VerifyCommand : Prismcal {
  const std::string format1 = std::string(PRISM_SOURCE_DIR) + "/tests/recordings/format1";
  const std::string whole = format1 + "/gyro1-20261122T041303Z.csv";
};

TEST_F(VerifyCommand, ReturnsOneIfAFileHasAFault) {
  EXPECT_EQ(run("verify " + whole), 0);
  EXPECT_THAT(out_, HasSubstr("faults: 0; intact files: 1"));
  EXPECT_EQ(run("verify " + whole + " " + format1), 1);
  EXPECT_THAT(out_, HasSubstr(": torn: "));
  EXPECT_THAT(out_, HasSubstr("faults: 1; intact files: 5"));
  EXPECT_EQ(run("verify"), 64);
}

TEST_F(VerifyCommand, PrintsTheSameAsJson) {
  EXPECT_EQ(run("verify " + format1 + " --json"), 1);
  const auto json = nlohmann::json::parse(out_);
  EXPECT_EQ(json["faults"], 1);
  EXPECT_EQ(json["findings"].size(), 5u);
  EXPECT_EQ(json["sessions"].size(), 4u);
}

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
}  // namespace prism::commands
