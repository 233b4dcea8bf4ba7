// SPDX-License-Identifier: MIT
#include "tools/prismcal/commands/inspect_bytes.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

#include "base/file.hpp"
#include "config/search_path.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/hex_dump.hpp"
#include "drivers/text_log.hpp"
#include "tools/prismcal/recordings/recording.hpp"
#include "tools/prismcal/tables/containers.hpp"
#include "tools/prismcal/tables/text_lines.hpp"

namespace prism::commands {

Result<std::string> kind_of_bytes(const std::string& path) {
  if (recordings::is_capture(path)) return std::string("capture");
  const auto container = tables::container_of(path);
  if (!container) return tl::unexpected<Error>(container.error());
  if (container->is_mat || !container->refusal.empty()) return std::string();
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::array<char, 4096> bytes{};
  std::string_view first(bytes.data(), in->read(bytes));
  const bool wide =
      tables::detect_encoding(first).starts_with("UTF-16") || tables::detect_encoding(first).starts_with("UTF-32");
  const auto control = std::count_if(first.begin(), first.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\r' && c != '\t' && c != '\f';
  });
  if (!wide && control > 0 && static_cast<std::size_t>(control) * 20 > first.size()) return std::string("bytes");
  if (first.size() == bytes.size()) first = first.substr(0, first.rfind('\n') + 1);
  if (drivers::bytes_of_hex_dump(first)) return std::string("hex dump");
  return std::string(drivers::is_text_log(first) ? "log of sentences" : "");
}

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
