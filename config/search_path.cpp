// SPDX-License-Identifier: MIT
#include "config/search_path.hpp"

#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "base/plain_text.hpp"

namespace prism::config {

namespace fs = std::filesystem;

namespace {

// Maximum depth of a program in the build tree.
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
  for (const fs::path& place : data_places(folder, base)) {
    std::error_code error;
    const fs::path candidate = place / (name + ".json");
    if (fs::exists(candidate, error)) return candidate.lexically_normal().string();
  }
  return (base / folder / (name + ".json")).lexically_normal().string();
}

std::vector<fs::path> data_places(const std::string& folder, const fs::path& base) {
  std::vector<fs::path> roots = {base};
  if (const char* data = std::getenv("PRISM_DATA")) roots.emplace_back(data);
  roots.insert(roots.end(), {"/etc/prism", own_data()});
  for (fs::path& root : roots) root = (root / folder).lexically_normal();
  return roots;
}

std::vector<std::string> data_files(const std::string& folder, const fs::path& base) {
  std::map<std::string, std::string> found;  // by name; the first directory has priority
  for (const fs::path& place : data_places(folder, base)) {
    std::error_code error;
    for (fs::directory_iterator entry(place, error), end; !error && entry != end; entry.increment(error)) {
      const fs::path& path = entry->path();
      if (path.extension() != ".json" || path.stem().extension() == ".schema") continue;
      found.emplace(path.stem().string(), path.string());
    }
  }
  std::vector<std::string> files;
  for (auto& [name, path] : found) files.push_back(std::move(path));
  return files;
}

namespace {

// A similar name and the searched directories; empty if `path` was not a bare name.
std::string hint_of(const fs::path& wanted, const std::string& folder) {
  if (wanted.parent_path().filename() != folder) return "";
  const fs::path base = wanted.parent_path().parent_path();
  std::vector<std::string> names;
  for (const std::string& file : data_files(folder, base)) names.push_back(fs::path(file).stem().string());
  const std::string near = nearest_name(wanted.stem().string(), names);
  std::string places;
  for (const fs::path& place : data_places(folder, base)) places += (places.empty() ? "" : ", ") + place.string();
  return (near.empty() ? "; looked in " : "; did you mean \"" + near + "\"? Looked in ") + places;
}

}  // namespace

Result<std::string> read_data_file(const std::string& path, const std::string& folder) {
  Result<std::string> text = read_text_file(path, folder == "models" ? kMaxModelBytes : kMaxTextBytes);
  std::error_code error;
  if (text || fs::exists(path, error)) return text;
  return make_error(text.error().where, text.error().what + hint_of(path, folder));
}

}  // namespace prism::config
