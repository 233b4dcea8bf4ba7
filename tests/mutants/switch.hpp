// SPDX-License-Identifier: MIT
// Selects the fault of tools/mutants at run time. Only the copy of the tree that tools/mutants builds includes it,
// first in each file.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <string>

inline int prism_mutant_chosen = -1;  // $PRISM_MUTANT
inline unsigned char* prism_mutant_reached =
    nullptr;  // the file $PRISM_MUTANT_REACHED: a byte per fault, 1 if it was reached
inline bool prism_mutant_is_loaded = false;

/// The whole file, or what can be read of it.
inline std::string prism_mutant_content(const std::string& path) {
  std::string text;
  if (std::FILE* file = std::fopen(path.c_str(), "rbe")) {
    for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) text += static_cast<char>(c);
    std::fclose(file);
  }
  return text;
}

/// The variable in the environment with which this process or its nearest ancestor with the variable was started; some
/// tests clear the environment of their programs. Empty if no ancestor has it.
inline std::string prism_mutant_variable(const std::string& name) {
  if (const char* value = std::getenv(name.c_str())) return value;
  for (int pid = ::getppid(), next = 0; pid > 1; pid = next) {
    const std::string folder = "/proc/" + std::to_string(pid),
                      all = std::string(1, '\0') + prism_mutant_content(folder + "/environ");
    const auto at = all.find(std::string(1, '\0') + name + "=");
    if (at != std::string::npos) return all.c_str() + at + name.size() + 2;
    const std::string status = prism_mutant_content(folder + "/status");
    const auto parent = status.find("\nPPid:");
    next = parent == std::string::npos ? 0 : std::atoi(status.c_str() + parent + 6);
  }
  return {};
}

/// Runs before every initialiser of the program or library, once for all of its files.
[[gnu::constructor(101)]] static void prism_mutant_load() {
  if (prism_mutant_is_loaded) return;
  prism_mutant_is_loaded = true;
  const std::string chosen = prism_mutant_variable("PRISM_MUTANT");
  if (!chosen.empty()) {
    prism_mutant_chosen = std::atoi(chosen.c_str());
    return;
  }
  const std::string path = prism_mutant_variable("PRISM_MUTANT_REACHED");
  const int file = path.empty() ? -1 : ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  struct stat size {};
  if (file < 0 || ::fstat(file, &size) != 0) return;
  void* bytes = ::mmap(nullptr, static_cast<std::size_t>(size.st_size), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  if (bytes != MAP_FAILED) prism_mutant_reached = static_cast<unsigned char*>(bytes);
}

inline bool prism_mutant(int fault) noexcept {
  if (prism_mutant_reached != nullptr) prism_mutant_reached[fault] = 1;
  return fault == prism_mutant_chosen;
}

/// In functions and members that constant expressions may use: there, without the fault.
constexpr bool prism_mutant_constexpr(int fault) noexcept {
  return !__builtin_is_constant_evaluated() && prism_mutant(fault);
}
