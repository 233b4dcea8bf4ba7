// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/inspect_bytes.hpp"

#include <filesystem>

#include "config/search_path.hpp"
#include "drivers/capture_file.hpp"

namespace prism::commands {

Result<std::vector<wire::SniffScore>> fitting_descriptions(const std::string& path) {
  std::error_code error;
  std::vector<wire::FrameDescriptionPtr> descriptions;
  for (const std::string& file : config::data_files("frames", std::filesystem::current_path(error))) {
    const auto text = config::read_data_file(file, "frames", "DESCRIPTION");
    if (!text) continue;
    if (const auto description = wire::parse_frame_description(*text, file)) descriptions.push_back(*description);
  }
  constexpr drivers::RawByteStream kAtOnce{1e12, 0};  // raw bytes have no times
  auto reader = drivers::CaptureReader::open(path, kAtOnce);
  if (!reader) return tl::unexpected<Error>(reader.error());
  wire::Sniffer sniffer(std::move(descriptions));
  while (const auto packet = reader->next()) {
    if (packet->event == drivers::CaptureEvent::kData)
      sniffer.feed(packet->bytes, reader->is_bare() ? 0 : packet->time_ns);
  }
  std::vector<wire::SniffScore> ranking = sniffer.ranking();
  std::erase_if(ranking, [](const wire::SniffScore& score) { return !score.fits; });
  return ranking;
}

}  // namespace prism::commands
