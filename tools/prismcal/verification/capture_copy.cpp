// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "base/plain_text.hpp"
#include "drivers/capture_file.hpp"
#include "tools/prismcal/verification/checks.hpp"
#include "tools/prismcal/verification/copies.hpp"
#include "tools/prismcal/verification/index_check.hpp"

namespace prism::verification {
namespace {

std::string name_of(const std::string& path) { return std::filesystem::path(path).filename().string(); }

// Copies prism's packets. Returns the number of other packets, which are left out.
Result<std::uint64_t> copy_packets(drivers::CaptureReader& reader, drivers::CapturePacket first,
                                   drivers::CaptureWriter& writer) {
  std::uint64_t others = 0;
  for (std::optional packet(first); packet; packet = reader.next()) {
    Result<void> done;
    if (packet->event == drivers::CaptureEvent::kOpened) done = writer.opened(packet->time_ns);
    if (packet->event == drivers::CaptureEvent::kData) done = writer.data(packet->time_ns, packet->bytes);
    if (packet->event == drivers::CaptureEvent::kSent) done = writer.sent(packet->time_ns, packet->bytes);
    others += packet->event == drivers::CaptureEvent::kOther;
    if (!done) return tl::unexpected<Error>(done.error());
  }
  if (auto done = writer.flush(true); !done) return tl::unexpected<Error>(done.error());
  return others + reader.foreign_packets();
}

// Returns false if no packet can be copied.
Result<bool> copy_capture(const std::string& path, const Copies& copies) {
  const auto [finding, damage] = check_capture(path);
  if (finding.state == FileState::kIntact) return copy_bytes(path, copies).map([] { return true; });
  auto reader = drivers::CaptureReader::open(path);
  const auto packet = reader ? reader->next() : std::nullopt;
  if (!packet) {
    copies.leave_out(path, 0, reader ? "contains no complete packet" : finding.text);
    return false;
  }
  auto writer = drivers::CaptureWriter::open(copies.target(path));
  if (!writer) return tl::unexpected<Error>(writer.error());
  const auto others = copy_packets(*reader, *packet, *writer);
  if (!others) return tl::unexpected<Error>(others.error());
  if (*others > 0) copies.leave_out(path, 0, counted(*others, "packet") + " of other programs");
  if (!damage.empty()) copies.leave_out(path, 0, damage);
  return true;
}

}  // namespace

Result<void> copy_captures(const FolderContents& contents, const Copies& copies) {
  const Indexes indexes(contents.folder, ".pcap");
  std::vector<std::string> paths = contents.captures;
  const auto age = [&](const std::string& path) { return std::tuple(indexes.number(name_of(path)), path); };
  std::sort(paths.begin(), paths.end(), [&](const std::string& a, const std::string& b) { return age(a) < age(b); });
  std::vector<std::pair<std::string, std::uint64_t>> made;
  for (const std::string& path : paths) {
    const auto copied = copy_capture(path, copies);
    if (!copied) return tl::unexpected<Error>(copied.error());
    if (*copied) made.emplace_back(name_of(path), 0);
  }
  copies.repaired.captures += made.size();
  return indexes.file().empty() || made.empty() ? Result<void>() : write_index(indexes.file(), made, copies);
}

}  // namespace prism::verification
