// SPDX-License-Identifier: MIT
#include "tools/client/instances.hpp"

#include <algorithm>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "config/socket_path.hpp"

namespace prism::client {
namespace {

void add_folder(std::vector<InstanceSocket>& found, const std::string& folder, std::vector<std::string>* invalid) {
  for (const std::string& path : config::sockets_in(folder, invalid))
    found.push_back({config::instance_name(path), path});
}

std::vector<InstanceSocket> all_places(std::vector<std::string>* invalid) {
  std::vector<InstanceSocket> found;
  for (const std::string& folder : config::socket_folders()) add_folder(found, folder, invalid);
  return found;
}

std::string path_of(const std::string& entry, const std::vector<InstanceSocket>& all) {
  if (entry.find('/') != std::string::npos) return entry;
  const auto named = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == entry; });
  return named != all.end() ? named->path : config::default_socket(entry);
}

}  // namespace

std::vector<InstanceSocket> list_instances(const std::vector<std::string>& entries, std::vector<std::string>* invalid) {
  if (entries.empty()) return all_places(invalid);
  const std::vector<InstanceSocket> all = all_places(nullptr);
  std::vector<InstanceSocket> found;
  for (const std::string& entry : entries) {
    if (entry.ends_with('/')) {
      add_folder(found, entry, invalid);
      continue;
    }
    const std::string path = path_of(entry, all), name = config::instance_name(path);
    if (follows(TextRule::kName, name)) {
      found.push_back({name, path});
    } else if (invalid != nullptr) {
      invalid->push_back(printable(path));
    }
  }
  return found;
}

}  // namespace prism::client
