// SPDX-License-Identifier: MIT
// Any bytes as a model file: rejected in one printable line, or its texts go into a log's header, a report and a batch.
#include <cstdint>
#include <string_view>

#include "base/outside_text.hpp"
#include "compensation/model_text.hpp"
#include "tests/fuzz/outputs.hpp"
#include "tests/fuzz/require.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto model = prism::compensation::parse_model({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  if (!model) {
    prism::test::require_printable_line(model.error().text());
    return 0;
  }
  const prism::compensation::ModelInfo& info = (*model)->info();
  require(prism::is_printable(info.name) && prism::is_printable(info.gyro_serial));
  if (info.table) return 0;
  prism::test::through_report_and_batch("# prism 0.3.0 data log, format 2\n# model: " + info.id + " " + info.name +
                                            "\n# gyro_serial: " + info.gyro_serial + "\n",
                                        **model);
  return 0;
}
