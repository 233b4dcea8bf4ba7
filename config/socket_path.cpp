// SPDX-License-Identifier: MIT
#include "config/socket_path.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/escape.hpp"
#include "base/outside_text.hpp"

namespace prism::config {
namespace {

constexpr const char* kSystemFolder = "/run/prismd";

bool is_set(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

// Empty if this user has no such directory.
std::string user_folder() {
  if (is_set("XDG_RUNTIME_DIR")) return std::string(std::getenv("XDG_RUNTIME_DIR")) + "/prismd";
  const std::string usual = "/run/user/" + std::to_string(::geteuid());
  std::error_code error;
  return std::filesystem::is_directory(usual, error) ? usual + "/prismd" : "";
}

}  // namespace

std::vector<std::string> socket_folders() {
  std::vector<std::string> folders = {kSystemFolder};
  if (std::string own = user_folder(); !own.empty()) folders.push_back(std::move(own));
  return folders;
}

std::string default_socket(const std::string& instance) {
  const std::string own = user_folder();
  const bool system = ::geteuid() == 0 || is_set("LOGS_DIRECTORY") || own.empty();
  return (system ? std::string(kSystemFolder) : own) + "/" + instance + ".sock";
}

std::vector<std::string> sockets_in(const std::string& directory, std::vector<std::string>* invalid) {
  std::vector<std::string> found;
  std::error_code error;
  for (std::filesystem::directory_iterator at(directory, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() != ".sock") continue;
    if (follows(TextRule::kName, instance_name(at->path().string()))) {
      found.push_back(at->path().string());
    } else if (invalid != nullptr) {
      invalid->push_back(printable(at->path().string()));
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string instance_name(const std::string& socket) { return std::filesystem::path(socket).stem().string(); }

bool would_start(const std::string& socket) {
  const std::filesystem::path path = socket;
  std::error_code error;
  const auto activated = path.parent_path() / "activated" / path.filename();
  if (!std::filesystem::is_symlink(std::filesystem::symlink_status(activated, error))) return false;
  return !std::filesystem::exists(path.parent_path() / "running" / path.stem(), error);
}

std::vector<std::string> relay_status_files() {
  std::vector<std::string> files = {"/run/prismrelay/status.json"};
  if (is_set("XDG_RUNTIME_DIR")) files.push_back(std::string(std::getenv("XDG_RUNTIME_DIR")) + "/prismrelay.json");
  return files;
}

}  // namespace prism::config
