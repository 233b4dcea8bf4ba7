// SPDX-License-Identifier: MIT
#include "config/search_path.hpp"

#include <cstdlib>
#include <vector>

namespace prism::config {

namespace fs = std::filesystem;

namespace {

// A program of the build tree is at most this many folders below it.
constexpr int kFoldersUp = 4;

fs::path own_data() {
  std::error_code error;
  fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (int up = 0; up < kFoldersUp && !folder.empty(); ++up, folder = folder.parent_path()) {
    if (fs::path data = folder / "share" / "prism"; fs::is_directory(data, error)) return fs::canonical(data, error);
  }
  return "/usr/share/prism";
}

}  // namespace

std::string find_data_file(const std::string& name, const std::string& folder, const fs::path& base) {
  const bool is_path = name.find('/') != std::string::npos || fs::path(name).extension() == ".json";
  if (is_path) return (base / name).lexically_normal().string();
  std::vector<fs::path> roots = {base};
  if (const char* data = std::getenv("PRISM_DATA")) roots.emplace_back(data);
  roots.insert(roots.end(), {"/etc/prism", own_data()});
  for (const fs::path& root : roots) {
    std::error_code error;
    const fs::path candidate = root / folder / (name + ".json");
    if (fs::exists(candidate, error)) return candidate.lexically_normal().string();
  }
  return (base / folder / (name + ".json")).lexically_normal().string();
}

}  // namespace prism::config
