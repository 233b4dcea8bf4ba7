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
constexpr const char* kAsked = "PRISM_LEVEL";  // what a program was begun again for: it does not try twice

/// What is kept from the loader, docs/compensation.md. Without AVX2, libm takes no fused multiply-add either.
const char* mask_of(const std::string& level) {
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
  const char* asked = std::getenv(kAsked);
  if ((asked && asked == level) || *mask_of(level) == 0)
    return make_error("level",
                      fmt::format("found {} on this machine, expected {}; \"level\" of the campaign sets one that "
                                  "all machines have",
                                  loaded, level));
  ::setenv(kTunables, mask_of(level), 1);
  ::setenv(kAsked, level.c_str(), 1);
  ::execv("/proc/self/exe", argv);
  return make_error("/proc/self/exe", std::strerror(errno));
}

}  // namespace prism::campaign
