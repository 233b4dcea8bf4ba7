// SPDX-License-Identifier: MIT
// Any bytes as a frame description: rejected in one printable line, or its names go into a log's header, a report and a
// batch.
#include <cstdint>
#include <string>
#include <string_view>

#include "base/outside_text.hpp"
#include "compensation/compensated_text.hpp"
#include "drivers/wire/description/frame_description.hpp"
#include "tests/fuzz/outputs.hpp"
#include "tests/fuzz/require.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = prism::wire::parse_frame_description({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  if (!parsed) {
    prism::test::require_printable_line(parsed.error().text());
    return 0;
  }
  const prism::wire::FrameDescription& frames = **parsed;
  require(prism::follows(prism::TextRule::kName, frames.name));
  std::string header = "# prism 0.3.0 data log, format 2\n# frames: " + frames.name + " " + frames.id + "\n";
  for (const std::string& axis : frames.axis_names) require(prism::follows(prism::TextRule::kAxisName, axis));
  if (!frames.axes.empty() && !frames.axes[0].name.empty()) header += "# axis: " + frames.axes[0].name + "\n";
  if (frames.title.size() < 4000) header += "# remark: " + frames.title + "\n";
  require(prism::test::through_report_and_batch(header, prism::test::shipped_model()));
  return 0;
}
