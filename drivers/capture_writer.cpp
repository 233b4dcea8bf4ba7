// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <pcap/pcap.h>
#include <stdio_ext.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "drivers/capture_file.hpp"

namespace prism::drivers {
namespace {

constexpr std::size_t kMostBytes = 65536;  // of the line in one packet; longer chunks become several
constexpr int kSnapBytes = static_cast<int>(kMostBytes + kCaptureRecordBytes);
constexpr std::size_t kBufferBytes = 1 << 18;
constexpr std::uint64_t kFileHeaderBytes = 24, kPacketHeaderBytes = 16;

}  // namespace

// pcap_dump() wants record and bytes in one piece, so a packet is put together here; it reports no errors, so the
// stream's own error flag is asked.
struct CaptureWriter::File {
  std::string path, failure;
  std::vector<char> buffer;
  std::vector<std::uint8_t> packet;
  pcap_t* pcap = nullptr;
  pcap_dumper_t* dumper = nullptr;
  std::FILE* stream = nullptr;
  std::uint64_t size = kFileHeaderBytes;

  ~File() {
    if (dumper) {
      pcap_dump_close(dumper);  // closes the stream too
    } else if (stream) {
      std::fclose(stream);
    }
    if (pcap) pcap_close(pcap);
  }

  Result<void> state() {
    if (failure.empty() && ferror_unlocked(stream)) fail();
    if (!failure.empty()) return refuse(path, failure);
    return {};
  }

  void fail() { failure = fmt::format("cannot be written: {}", std::strerror(errno)); }

  Result<void> append(std::int64_t time_ns, CaptureEvent event, std::span<const std::uint8_t> bytes) {
    const auto record = encode_capture_record(time_ns, event);
    packet.assign(record.begin(), record.end());
    packet.insert(packet.end(), bytes.begin(), bytes.end());
    pcap_pkthdr header;
    header.ts.tv_sec = time_ns / 1'000'000'000;
    header.ts.tv_usec = time_ns % 1'000'000'000;  // nanoseconds: the file's magic says so
    header.caplen = header.len = static_cast<bpf_u_int32>(packet.size());
    if (!failure.empty()) return state();
    pcap_dump(reinterpret_cast<u_char*>(dumper), &header, packet.data());
    size += kPacketHeaderBytes + packet.size();
    return state();
  }
};

CaptureWriter::CaptureWriter(std::unique_ptr<File> file) : file_(std::move(file)) {}
CaptureWriter::CaptureWriter(CaptureWriter&&) noexcept = default;
CaptureWriter& CaptureWriter::operator=(CaptureWriter&&) noexcept = default;
CaptureWriter::~CaptureWriter() = default;

Result<CaptureWriter> CaptureWriter::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return refuse(path, fmt::format("cannot be created: {}", std::strerror(errno)));
  return adopt(descriptor, path);
}

Result<CaptureWriter> CaptureWriter::adopt(int descriptor, const std::string& path) {
  auto file = std::make_unique<File>();
  file->path = path;
  file->buffer.resize(kBufferBytes);
  file->packet.reserve(kSnapBytes);
  file->stream = ::fdopen(descriptor, "wb");
  if (!file->stream) {
    ::close(descriptor);
    return refuse(path, "cannot be opened: out of memory");
  }
  std::setvbuf(file->stream, file->buffer.data(), _IOFBF, file->buffer.size());
  __fsetlocking(file->stream, FSETLOCKING_BYCALLER);  // one thread writes
  file->pcap = pcap_open_dead_with_tstamp_precision(kCaptureLinkType, kSnapBytes, PCAP_TSTAMP_PRECISION_NANO);
  if (file->pcap) file->dumper = pcap_dump_fopen(file->pcap, file->stream);
  if (!file->dumper)
    return refuse(path, file->pcap ? pcap_geterr(file->pcap) : "libpcap gave no handle: out of memory");
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

Result<void> CaptureWriter::opened(std::int64_t time_ns) { return file_->append(time_ns, CaptureEvent::kOpened, {}); }

Result<void> CaptureWriter::flush(bool sync) {
  if (file_->failure.empty()) {
    if (std::fflush(file_->stream) != 0 || (sync && ::fdatasync(fileno(file_->stream)) != 0)) file_->fail();
  }
  return file_->state();
}

int CaptureWriter::descriptor() const { return fileno(file_->stream); }

const std::string& CaptureWriter::path() const { return file_->path; }

std::uint64_t CaptureWriter::bytes_written() const { return file_->size; }

}  // namespace prism::drivers
