// SPDX-License-Identifier: MIT
#include "tools/prismctl/output.hpp"

#include <unistd.h>

namespace prism::prismctl {

void print_log_line(std::string_view line) {
  static const bool terminal = ::isatty(STDOUT_FILENO) == 1;
  if (terminal) return fmt::print("{}\n", printable(line));
  fmt::print("{}\n", line);
}

}  // namespace prism::prismctl
