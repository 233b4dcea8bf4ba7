// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <filesystem>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "base/text_number.hpp"
#include "drivers/capture_file.hpp"
#include "tools/prismcal/verification/checks.hpp"
#include "tools/prismcal/verification/segment_check.hpp"

namespace prism::verification {
namespace {

Finding check_capture(const std::string& path) {
  const bool open = is_locked(path);  // checked before reading: a capture that ends meanwhile is read to its end
  auto reader = drivers::CaptureReader::open(path);
  if (!reader) return {path, FileState::kUnreadable, without_path(reader.error(), path)};
  std::size_t packets = 0, opened = 0, bytes = 0, sent = 0, others = 0, back = 0;
  std::int64_t first_ns = 0, last_ns = 0;
  std::uint64_t good = 0;
  for (; const auto packet = reader->next(); ++packets) {
    const bool opens = packet->event == drivers::CaptureEvent::kOpened;
    if (packets == 0) first_ns = packet->time_ns;
    back += packets > 0 && !opens && packet->time_ns < last_ns;
    last_ns = packet->time_ns;
    good = reader->position_bytes();
    opened += opens;
    others += packet->event == drivers::CaptureEvent::kOther;
    if (packet->event == drivers::CaptureEvent::kData) bytes += packet->bytes.size();
    if (packet->event == drivers::CaptureEvent::kSent) sent += packet->bytes.size();
  }
  others += reader->foreign_packets();
  std::string text = fmt::format("{}, {} of the line, opened {}", counted(packets, "packet"), counted(bytes, "byte"),
                                 counted(opened, "time"));
  if (sent > 0) text += ", " + counted(sent, "byte") + " sent to the device";
  if (packets > 0) text += fmt::format(", {} to {}", utc_nano_text(first_ns), utc_nano_text(last_ns));
  if (back > 0) text += "; the time goes back " + counted(back, "time");
  if (others > 0) text += "; " + counted(others, "packet") + " of other programs";
  if (open) return {path, FileState::kOpen, text + "; prismd writes it"};
  std::string damage = reader->damaged_places().text();
  const FileState state = damage.empty() ? FileState::kTruncated : FileState::kDamaged;
  if (!reader->tail_damage().empty())
    damage += fmt::format("{}{} bytes from byte {} on are not a complete packet ({})", damage.empty() ? "" : "; ",
                          reader->size_bytes() - good, good, without_path({"", reader->tail_damage()}, path));
  if (damage.empty()) return {path, FileState::kIntact, text};
  return {path, state, fmt::format("{}; {}", text, damage)};
}

}  // namespace

void check_captures(const FolderContents& contents, VerificationResult& result) {
  for (const std::string& path : contents.captures) result.findings.push_back(check_capture(path));
  if (contents.one_file) return;
  check_old_indexes(contents.folder, ".pcap", {}, result.findings);
  std::vector<NumberedSegment> numbered;
  for (const std::string& path : contents.captures) {
    const std::string file = std::filesystem::path(path).filename().string();
    std::size_t end = file.size();  // of the name, which has no number, begin and running time
    for (int i = 0; i < 3 && end != std::string::npos && end > 0; ++i) end = file.rfind('-', end - 1);
    const std::string name = end == std::string::npos ? "" : file.substr(0, end);
    const auto found = pipeline::SegmentName::parse(file, name, ".pcap");
    if (found && found->number > 0) numbered.push_back({path, {name, found->number, 1, 0}, 0, found->begin_s});
  }
  const bool has_older = numbered.size() < contents.captures.size();
  check_numbers(contents.folder, has_older, std::move(numbered), result.findings);
}

}  // namespace prism::verification
