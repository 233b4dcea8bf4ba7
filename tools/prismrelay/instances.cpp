// SPDX-License-Identifier: MIT
#include "tools/prismrelay/instances.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "config/socket_place.hpp"

namespace prism::prismrelay {

namespace fs = std::filesystem;

std::map<std::string, std::string> find_instances(const std::vector<std::string>& entries) {
  std::map<std::string, std::string> found;
  for (const std::string& entry : entries) {
    if (entry.back() != '/') {
      const bool name = entry.find('/') == std::string::npos;
      const std::string path = name ? config::socket_folders().front() + "/" + entry + ".sock" : entry;
      found.try_emplace(fs::path(path).stem().string(), path);
      continue;
    }
    std::vector<std::string> sockets;
    std::error_code error;
    fs::directory_iterator at(entry, error);
    for (; !error && at != fs::directory_iterator(); at.increment(error)) {
      if (at->path().extension() == ".sock") sockets.push_back(at->path().string());
    }
    std::sort(sockets.begin(), sockets.end());
    for (const std::string& path : sockets) found.try_emplace(fs::path(path).stem().string(), path);
  }
  return found;
}

}  // namespace prism::prismrelay
