// SPDX-License-Identifier: MIT
// The decoder must return the same messages for any size of the chunks that it is fed. The first byte selects the
// description, the second the size.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "drivers/wire/decode/frame_decoder.hpp"

namespace {

namespace wire = prism::wire;

using prism::wire::DecodedMessage;
using prism::wire::FrameDecoder;
using prism::wire::FrameDescriptionPtr;

std::vector<wire::FrameDescriptionPtr> load_all() {
  std::vector<wire::FrameDescriptionPtr> all;
  for (const char* folder : {PRISM_SOURCE_DIR "/config/frames", PRISM_SOURCE_DIR "/tests/replay/frames/described"}) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      if (auto parsed = prism::wire::parse_frame_description(text, entry.path().string())) all.push_back(*parsed);
    }
  }
  if (all.empty()) std::abort();
  return all;
}

std::vector<wire::DecodedMessage> decode(const wire::FrameDescriptionPtr& description, const std::uint8_t* bytes,
                                         std::size_t size, std::size_t chunk) {
  wire::FrameDecoder decoder(description);
  std::vector<wire::DecodedMessage> out;
  for (std::size_t at = 0; at < size; at += chunk) decoder.feed({bytes + at, std::min(chunk, size - at)}, 0, out);
  decoder.finish(out);
  if (decoder.waiting()) std::abort();
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<wire::FrameDescriptionPtr> kAll = load_all();
  if (size < 2) return 0;
  const wire::FrameDescriptionPtr& description = kAll[data[0] % kAll.size()];
  const std::vector<wire::DecodedMessage> whole = decode(description, data + 2, size - 2, size);
  const std::vector<wire::DecodedMessage> cut = decode(description, data + 2, size - 2, 1u + data[1] % 64u);
  if (whole.size() != cut.size()) std::abort();
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (whole[i].offset != cut[i].offset || whole[i].counter != cut[i].counter) std::abort();
  }
  return 0;
}
