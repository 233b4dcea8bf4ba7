// SPDX-License-Identifier: MIT
// Any bytes as a model file: rejected in one line of ASCII, or a model that is the same after writing and reading.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/model_text.hpp"
#include "tests/fuzz/require.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto model = prism::compensation::parse_model(text, "fuzz.json");
  if (!model) {
    const std::string line = model.error().text();
    require(!line.empty() && line.size() < 1000);
    for (const char c : line) require(c >= 0x20 && c <= 0x7e);
    return 0;
  }
  const std::string written = prism::compensation::format_model(**model);
  const auto again = prism::compensation::parse_model(written, "again.json");
  require(again.has_value());
  require((*again)->info().id == (*model)->info().id);
  require(prism::compensation::format_model(**again) == written);
  const std::vector<double> inputs((*model)->info().inputs.size(), 0.5);
  const double bias = (*model)->predict(inputs).bias_deg_per_h, same = (*again)->predict(inputs).bias_deg_per_h;
  require(bias == same || (std::isnan(bias) && std::isnan(same)));
  return 0;
}
