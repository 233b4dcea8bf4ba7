// SPDX-License-Identifier: MIT
// Fixtures of the campaign tests: log files of a lot of gyros, and tasks without work.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/campaign/tasks.hpp"

namespace prism::test {

/// Creates logs; only their metadata is valid.
class Lot {
 public:
  void log(const std::string& name, const std::string& serial, const std::string& rows = "1\n") const {
    const std::filesystem::path path = folder_.file(name);
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << "# prism 0.2.0 data log, format 2\n# instance: g\n# gyro_serial: " << serial
                        << "\n# axis: z\n"
                        << rows;
  }
  void gyro(const std::string& serial) const {
    log(serial + "/cycle1.csv", serial);
    log(serial + "/cycle2.csv", serial, "2\n");
  }
  std::string path(const std::string& name) const { return folder_.file(name); }
  campaign::LotFile file() const {
    return campaign::parse_lot_file(R"({"recordings": [{"role": "train", "paths": "*/cycle1.csv"},
                                                       {"role": "repeat", "paths": "*/cycle2.csv"}],
                                        "models": {"a": {"folds": 5}, "b": {}}, "output": {"folder": "out"}})",
                                    path("lot.json"))
        .value();
  }

 private:
  TemporaryFolder folder_;
};

inline campaign::Work quick_work() {
  campaign::Work work;
  work.version = "1";
  work.check = [](const campaign::LotFile&) { return Result<void>(); };
  work.run = [](const campaign::Task& task, const std::string& folder) -> Result<Json> {
    std::ofstream(folder + "/model.json") << task.model.name;
    return Json{
        {"outcome", "trained"},    {"serial", task.serial},
        {"axis", task.axis},       {"level", ""},
        {"version", "1"},          {"id", ""},
        {"simulated", false},      {"data_quality", Json::array()},
        {"judged", Json::array()}, {"training", {{"mean_deg_per_h", 1}, {"curve_degc_deg_per_h", Json::array()}}}};
  };
  return work;
}

}  // namespace prism::test
