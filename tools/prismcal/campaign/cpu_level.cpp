// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/cpu_level.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "compensation/kernels/kernels.hpp"

namespace prism::campaign {
namespace {

constexpr const char* kTunables = "GLIBC_TUNABLES";
constexpr const char* kRestartedFor = "PRISM_LEVEL";  // level of the restart, so that it is tried only once

/// GLIBC_TUNABLES that hide the higher levels (docs/compensation.md). Without AVX2, libm uses no fused multiply-add
/// either.
const char* tunables_for(const std::string& level) {
  if (level == "x86-64-v3") return "glibc.cpu.hwcaps=-AVX512F";
  if (level == "baseline") return "glibc.cpu.hwcaps=-AVX512F,-AVX2";
  return "";
}

}  // namespace

std::string loaded_level() {
  Dl_info found{};
  if (::dladdr(reinterpret_cast<const void*>(&kernels::rbf_row), &found) == 0 || !found.dli_fname) return "baseline";
  const std::string path = found.dli_fname;
  for (const char* level : {"x86-64-v4", "x86-64-v3"}) {
    if (path.find(fmt::format("/glibc-hwcaps/{}/", level)) != std::string::npos) return level;
  }
  return "baseline";
}

Result<void> run_at_level(const std::string& level, char** argv) {
  const std::string loaded = loaded_level();
  if (loaded == level) return {};
  const char* restarted_for = std::getenv(kRestartedFor);
  if ((restarted_for && restarted_for == level) || *tunables_for(level) == 0)
    return make_error("level",
                      fmt::format("found {} on this machine, expected {}; set \"level\" of the campaign to one that "
                                  "all machines have",
                                  loaded, level));
  ::setenv(kTunables, tunables_for(level), 1);
  ::setenv(kRestartedFor, level.c_str(), 1);
  ::execv("/proc/self/exe", argv);
  return make_error("/proc/self/exe", std::strerror(errno));
}

}  // namespace prism::campaign
