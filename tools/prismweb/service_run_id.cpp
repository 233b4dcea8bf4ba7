// SPDX-License-Identifier: MIT
#include "tools/prismweb/service_run_id.hpp"

#include <sys/stat.h>

#include <filesystem>

namespace prism::prismweb {

ServiceRunId service_run_id(const std::string& socket) {
  const std::filesystem::path path = socket;
  struct stat found {};
  if (::lstat((path.parent_path() / "activated" / path.filename()).c_str(), &found) != 0) return std::nullopt;
  if (::stat((path.parent_path() / "running" / path.stem()).c_str(), &found) != 0) return std::nullopt;
  return std::pair<std::uint64_t, std::int64_t>(found.st_ino,
                                                found.st_ctim.tv_sec * 1'000'000'000 + found.st_ctim.tv_nsec);
}

}  // namespace prism::prismweb
