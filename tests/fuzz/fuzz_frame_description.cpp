// SPDX-License-Identifier: MIT
// Any bytes as a frame description: rejected in one line, or encoder and decoder accept it.
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"
#include "drivers/wire/decode/inspect.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = prism::wire::parse_frame_description({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  if (!parsed) {
    if (parsed.error().what.empty() || parsed.error().text().find('\n') != std::string::npos) std::abort();
    return 0;
  }
  (void)prism::wire::run_test_vectors(**parsed);
  prism::wire::FrameEncoder encoder(*parsed);
  prism::wire::FrameDecoder decoder(*parsed);
  std::vector<std::uint8_t> bytes;
  std::vector<prism::wire::DecodedMessage> out;
  for (int i = 0; i < 20; ++i) encoder.encode({.rate_deg_per_h = {10.0 * i}, .interval_s = 0.01}, bytes);
  decoder.feed(bytes, 0, out);
  decoder.finish(out);
  return 0;
}
