// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/population_models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "tools/prismcal/commands/commands.hpp"

namespace prism::commands {

Result<std::vector<compensation::ModelPtr>> read_population_models(const std::string& folder,
                                                                   const std::string& own_serial) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<std::string> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().extension() == ".json") files.push_back(entry->path().string());
  }
  if (error) return make_error(folder, fmt::format("{}; expected a folder of models", error.message()));
  std::sort(files.begin(), files.end());
  std::vector<compensation::ModelPtr> models;
  std::size_t own = 0;
  for (const std::string& file : files) {
    auto model = load_model(file);
    if (!model) return tl::unexpected<Error>(model.error());
    const bool is_own = !own_serial.empty() && (*model)->info().gyro_serial == own_serial;
    own += is_own;
    if (!is_own) models.push_back(std::move(*model));
  }
  if (models.size() < 2) {
    return make_error(folder, fmt::format("found {} models of other gyros ({} of this one), expected at least 2",
                                          models.size(), own));
  }
  return models;
}

}  // namespace prism::commands
