// SPDX-License-Identifier: MIT
// Any bytes as the header of a log: rejected in one printable line, or its report and its batch are valid.
#include <cstdint>
#include <string>

#include "tests/fuzz/outputs.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 8192) return 0;
  std::string header(reinterpret_cast<const char*>(data), size);
  if (!header.ends_with('\n')) header += '\n';
  prism::test::through_report_and_batch("# prism 0.3.0 data log, format 2\n" + header, prism::test::shipped_model());
  return 0;
}
