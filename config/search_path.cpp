// SPDX-License-Identifier: MIT
#include "config/search_path.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string_view>
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

constexpr std::size_t kMaxNames = 40;

// `wanted`: the path of a bare name that does not exist.
std::string not_found(const fs::path& wanted, const std::string& folder) {
  const fs::path base = wanted.parent_path().parent_path();
  const std::string file = wanted.filename().string();
  const std::string name = file.substr(0, file.size() - std::string_view(".json").size());
  std::vector<std::string> names;
  for (const std::string& known : data_files(folder, base)) names.push_back(fs::path(known).stem().string());
  const std::string near = nearest_name(name, names);
  std::vector<std::string> places;
  std::error_code error;  // no working directory: relative places
  for (const fs::path& place : data_places(folder, base)) {
    const fs::path full = fs::absolute(place, error);
    places.push_back(error ? place.string() : full.string());
  }
  std::string expected = fmt::format("did you mean \"{}\"? Looked", near);
  if (near.empty()) {
    const std::size_t more = names.size() - std::min(names.size(), kMaxNames);
    names.resize(names.size() - more);
    expected = names.empty() ? "expected an existing name" : fmt::format("expected one of {}", fmt::join(names, ", "));
    expected += more == 0 ? "; looked" : fmt::format(" and {} more; looked", more);
  }
  return fmt::format("found \"{}\", {} for {} in {}", name, expected, file, fmt::join(places, ", "));
}

}  // namespace

Result<std::string> read_data_file(const std::string& path, const std::string& folder, const std::string& place) {
  Result<std::string> text = read_text_file(path, folder == "models" ? kMaxModelBytes : kMaxTextBytes);
  std::error_code error;
  if (text || fs::status(path, error).type() != fs::file_type::not_found) return text;
  const bool by_name = fs::path(path).parent_path().filename() == folder && path.ends_with(".json");
  return make_error(place, by_name ? not_found(path, folder) : text.error().text());
}

}  // namespace prism::config
