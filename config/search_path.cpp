// SPDX-License-Identifier: MIT
#include "config/search_path.hpp"

#include <cstdlib>
#include <vector>

namespace prism {

namespace fs = std::filesystem;

std::string find_data_file(const std::string& name, const std::string& folder, const fs::path& base) {
  const bool is_path = name.find('/') != std::string::npos || fs::path(name).extension() == ".json";
  if (is_path) return (base / name).lexically_normal().string();
  std::vector<fs::path> roots = {base};
  if (const char* data = std::getenv("PRISM_DATA")) roots.emplace_back(data);
  roots.insert(roots.end(), {"/etc/prism", PRISM_DATA_DIR, PRISM_SOURCE_CONFIG_DIR});
  for (const fs::path& root : roots) {
    std::error_code error;
    const fs::path candidate = root / folder / (name + ".json");
    if (fs::exists(candidate, error)) return candidate.lexically_normal().string();
  }
  return (base / folder / (name + ".json")).lexically_normal().string();
}

}  // namespace prism
