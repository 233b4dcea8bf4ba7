// SPDX-License-Identifier: MIT
// Fixtures of the campaign tests: log files of a lot of gyros, and tasks without work.
#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "compensation/compensated_text.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismcal/lot.hpp"

namespace prism::test {

/// Creates logs; only their metadata and names of columns are valid.
class Lot {
 public:
  void log(const std::string& name, const std::string& serial, const std::string& row = "1") const {
    const std::filesystem::path path = folder_.file(name);
    std::filesystem::create_directories(path.parent_path());
    std::string columns;
    for (std::size_t i = 0; i < compensation::kColumnsOfFormat1; ++i)
      columns += (i > 0 ? "," : "") + std::string(compensation::log_columns()[i].name);
    std::ofstream(path) << "# prism 0.2.0 data log, format 2\n# instance: g\n# gyro_serial: " << serial
                        << "\n# axis: z\n"
                        << columns << "\n"
                        << row << "\n";
  }
  void gyro(const std::string& serial) const {
    log(serial + "/cycle1.csv", serial);
    log(serial + "/cycle2.csv", serial, "2");
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

inline Result<Json> quick_work(const campaign::Task& task, const std::string& folder) {
  std::ofstream(folder + "/model.json") << task.model();
  return Json{{"outcome", "trained"},
              {"id", "12ab"},
              {"simulated", false},
              {"data_quality", Json::array()},
              {"training", {{"mean_deg_per_h", 1}}},
              {"judged", Json::array()}};
}

}  // namespace prism::test
