// SPDX-License-Identifier: MIT
#include "drivers/transport/device_users.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::transport {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kShown = 3;

bool has_open(const fs::path& process, const fs::path& device) {
  std::error_code error;
  fs::directory_iterator entry(process / "fd", error), end;
  for (; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (fs::read_symlink(entry->path(), unreadable) == device && !unreadable) return true;
  }
  return false;
}

}  // namespace

std::string other_users_of(const std::string& device) {
  std::error_code error;
  const fs::path canonical = fs::canonical(device, error);
  if (error) return {};
  const std::string own = std::to_string(::getpid());
  std::vector<std::string> users;
  fs::directory_iterator entry("/proc", error), end;
  for (; !error && entry != end && users.size() < kShown; entry.increment(error)) {
    const std::string pid = entry->path().filename();
    if (!std::all_of(pid.begin(), pid.end(), [](unsigned char c) { return std::isdigit(c) != 0; }) || pid == own)
      continue;
    if (!has_open(entry->path(), canonical)) continue;
    const auto name = read_text_file(entry->path() / "comm");
    users.push_back(fmt::format("{} (pid {})", name ? printable(name->substr(0, name->find('\n'))) : "a program", pid));
  }
  return fmt::to_string(fmt::join(users, ", "));
}

}  // namespace prism::transport
