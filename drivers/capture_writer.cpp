// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <span>
#include <utility>

#include "base/file.hpp"
#include "drivers/capture_file.hpp"

namespace prism::drivers {
namespace {

constexpr std::size_t kMostBytes = 65536;  // of the line in one packet; longer chunks are split
constexpr std::size_t kWriteBytes = 1 << 18;

// pcap in this machine's byte order; the magic number identifies it and nanosecond times.
struct FileHeader {
  std::uint32_t magic = 0xa1b23c4d;
  std::uint16_t major = 2, minor = 4;
  std::uint32_t zone = 0, accuracy = 0;
  std::uint32_t most_bytes = kMostBytes + kCaptureRecordBytes;
  std::uint32_t link_type = kCaptureLinkType;
};
struct PacketHeader {
  std::uint32_t seconds, nanoseconds, bytes, original_bytes;
};

}  // namespace

struct CaptureWriter::File {
  std::string path, failure;
  Again again;
  int descriptor = -1;
  std::vector<std::uint8_t> buffer;
  std::uint64_t size = 0;

  ~File() {
    drain();
    ::close(descriptor);
  }

  Result<void> state() const {
    if (!failure.empty()) return make_error(path, failure);
    return {};
  }

  void fail(int error) { failure = fmt::format("cannot be written: {}", std::strerror(error)); }

  void put(std::span<const std::uint8_t> header, std::span<const std::uint8_t> bytes) {
    const std::size_t before = buffer.size(), count = header.size() + bytes.size();
    buffer.resize(before + count);
    std::copy(bytes.begin(), bytes.end(), std::copy(header.begin(), header.end(), buffer.data() + before));
    size += count;
  }

  void drain() {
    for (std::size_t done = 0; failure.empty() && done < buffer.size();) {
      const ssize_t written = ::write(descriptor, buffer.data() + done, buffer.size() - done);
      if (written >= 0) {
        done += static_cast<std::size_t>(written);
      } else if (const int error = errno; error != EINTR && !(again && again(error))) {
        fail(error);
      }
    }
    buffer.clear();
  }

  Result<void> append(std::int64_t time_ns, CaptureEvent event, std::span<const std::uint8_t> bytes) {
    const auto record = encode_capture_record(time_ns, event);
    const auto count = static_cast<std::uint32_t>(record.size() + bytes.size());
    const PacketHeader header{static_cast<std::uint32_t>(time_ns / 1'000'000'000),
                              static_cast<std::uint32_t>(time_ns % 1'000'000'000), count, count};
    std::array<std::uint8_t, sizeof header + kCaptureRecordBytes> head;
    std::memcpy(head.data(), &header, sizeof header);
    std::copy(record.begin(), record.end(), head.begin() + sizeof header);
    put(head, bytes);
    if (buffer.size() >= kWriteBytes) drain();
    return state();
  }
};

CaptureWriter::CaptureWriter(std::unique_ptr<File> file) : file_(std::move(file)) {}
CaptureWriter::CaptureWriter(CaptureWriter&&) noexcept = default;
CaptureWriter& CaptureWriter::operator=(CaptureWriter&&) noexcept = default;
CaptureWriter::~CaptureWriter() = default;

Result<CaptureWriter> CaptureWriter::open(const std::string& path) {
  auto file = open_output(path);
  if (!file) return tl::unexpected<Error>(file.error());
  return adopt(file->release(), path, nullptr);
}

Result<CaptureWriter> CaptureWriter::adopt(int descriptor, const std::string& path, Again again) {
  auto file = std::make_unique<File>();
  file->path = path;
  file->again = std::move(again);
  file->descriptor = descriptor;
  const FileHeader header;
  file->put({reinterpret_cast<const std::uint8_t*>(&header), sizeof header}, {});
  CaptureWriter writer(std::move(file));
  if (auto written = writer.flush(); !written) return tl::unexpected<Error>(written.error());
  return writer;
}

Result<void> CaptureWriter::data(std::int64_t time_ns, std::span<const std::uint8_t> bytes) {
  while (bytes.size() > kMostBytes) {
    if (auto done = file_->append(time_ns, CaptureEvent::kData, bytes.first(kMostBytes)); !done) return done;
    bytes = bytes.subspan(kMostBytes);
  }
  return file_->append(time_ns, CaptureEvent::kData, bytes);
}

Result<void> CaptureWriter::sent(std::int64_t time_ns, std::span<const std::uint8_t> bytes) {
  return file_->append(time_ns, CaptureEvent::kSent, bytes);
}

Result<void> CaptureWriter::opened(std::int64_t time_ns) { return file_->append(time_ns, CaptureEvent::kOpened, {}); }

Result<void> CaptureWriter::flush(bool sync) {
  file_->drain();
  if (sync && file_->failure.empty() && ::fdatasync(file_->descriptor) != 0) file_->fail(errno);
  return file_->state();
}

int CaptureWriter::descriptor() const { return file_->descriptor; }

const std::string& CaptureWriter::path() const { return file_->path; }

std::uint64_t CaptureWriter::bytes_written() const { return file_->size; }

}  // namespace prism::drivers
