// SPDX-License-Identifier: MIT
#include "tools/prismweb/period_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

namespace prism::prismweb {
namespace {

constexpr std::size_t kChecked = kRecordBytes - 4, kBlockRecords = 1024;
using Record = std::array<unsigned char, kRecordBytes>;

std::uint32_t crc_of(const unsigned char* record) {
  boost::crc_32_type crc;
  crc.process_bytes(record, kChecked);
  return crc.checksum();
}

// Puts or takes one value after the other.
struct Cursor {
  unsigned char* at;
  template <class T>
  void put(T value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  }
  template <class T>
  void take(T& value) {
    std::memcpy(&value, at, sizeof value);
    at += sizeof value;
  }
};

std::uint16_t count16(std::uint32_t count) { return static_cast<std::uint16_t>(std::min<std::uint32_t>(count, 65535)); }

Record record_of(const Extremes& period) {
  Record record{};
  Cursor out{record.data()};
  out.put(period.begin_s);
  for (std::size_t i = 0; i < kQuantities; ++i) {
    if (i == kSd) continue;
    out.put(period.least[i]);
    out.put(period.greatest[i]);
  }
  out.put(static_cast<float>(period.greatest[kSd]));
  for (const KnownMean& mean : period.mean) out.put(static_cast<float>(mean.value()));
  out.put(period.samples);
  out.put(period.missing);
  out.put(count16(period.seconds));
  out.put(count16(period.good));
  for (const KnownMean& mean : period.mean) out.put(count16(mean.known));
  out.put(crc_of(record.data()));
  return record;
}

Extremes period_of(unsigned char* record) {
  Extremes period;
  Cursor in{record};
  in.take(period.begin_s);
  for (std::size_t i = 0; i < kQuantities; ++i) {
    if (i == kSd) continue;
    in.take(period.least[i]);
    in.take(period.greatest[i]);
  }
  float sd = 0;
  in.take(sd);
  period.least[kSd] = period.greatest[kSd] = static_cast<double>(sd);
  std::array<float, kMeans> means{};
  for (float& mean : means) in.take(mean);
  std::uint16_t seconds = 0, good = 0, known = 0;
  in.take(period.samples);
  in.take(period.missing);
  in.take(seconds);
  in.take(good);
  for (std::size_t i = 0; i < kMeans; ++i) {
    in.take(known);
    period.mean[i] = {known > 0 ? static_cast<double>(means[i]) * known : 0, known};
  }
  period.seconds = seconds;
  period.good = good;
  return period;
}

off_t offset_of(std::uint64_t record) { return static_cast<off_t>(record * kRecordBytes); }

}  // namespace

PeriodFile::PeriodFile(PeriodFile&& other) noexcept { *this = std::move(other); }

PeriodFile& PeriodFile::operator=(PeriodFile&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(path_, other.path_);
  std::swap(held_, other.held_);
  return *this;
}

PeriodFile::~PeriodFile() {
  if (fd_ >= 0) ::close(fd_);
}

Result<PeriodFile> PeriodFile::open(const std::string& path, std::uint64_t records) {
  PeriodFile file;
  file.path_ = path;
  file.fd_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NOCTTY, 0640);
  if (file.fd_ < 0) return refuse(path, std::strerror(errno));
  const off_t size = ::lseek(file.fd_, 0, SEEK_END);
  if (size < offset_of(records))
    return refuse(path, fmt::format("found {} bytes, expected {} records of {}", size, records, kRecordBytes));
  if (::ftruncate(file.fd_, offset_of(records)) != 0) return refuse(path, std::strerror(errno));
  file.held_.records = records;
  if (const Result<void> whole = file.look_through(); !whole) return tl::unexpected<Error>(whole.error());
  return file;
}

void PeriodFile::note(std::int64_t begin_s) {
  held_.in_order = held_.in_order && held_.last_begin_s <= begin_s;
  held_.last_begin_s = begin_s;
}

// Every record, a block at a time: a disk damages those in the middle, too, and years of them need no memory.
Result<void> PeriodFile::look_through() {
  std::vector<unsigned char> block(kBlockRecords * kRecordBytes);
  for (std::uint64_t first = 0; first < held_.records; first += kBlockRecords) {
    const std::uint64_t count = std::min<std::uint64_t>(kBlockRecords, held_.records - first);
    if (::pread(fd_, block.data(), count * kRecordBytes, offset_of(first)) != offset_of(count))
      return refuse(path_, std::strerror(errno));
    for (std::uint64_t i = 0; i < count; ++i) {
      const unsigned char* const record = block.data() + i * kRecordBytes;
      std::uint32_t crc = 0;
      std::int64_t begin_s = 0;
      std::memcpy(&crc, record + kChecked, sizeof crc);
      std::memcpy(&begin_s, record, sizeof begin_s);
      if (crc != crc_of(record)) return refuse(path_, fmt::format("record {} is damaged", first + i + 1));
      note(begin_s);
    }
  }
  return {};
}

Result<void> PeriodFile::append(std::span<const Extremes> periods) {
  std::string bytes;
  for (const Extremes& period : periods) {
    const Record record = record_of(period);
    bytes.append(reinterpret_cast<const char*>(record.data()), record.size());
  }
  if (::pwrite(fd_, bytes.data(), bytes.size(), offset_of(held_.records)) != static_cast<ssize_t>(bytes.size()))
    return refuse(path_, fmt::format("cannot write: {}", std::strerror(errno)));
  for (const Extremes& period : periods) note(period.begin_s);
  held_.records += periods.size();
  return {};
}

Result<void> PeriodFile::sync() {
  if (::fdatasync(fd_) != 0) return refuse(path_, fmt::format("cannot sync: {}", std::strerror(errno)));
  return {};
}

std::int64_t PeriodFile::begin_of(std::uint64_t record) const {
  std::int64_t begin_s = INT64_MAX;
  if (::pread(fd_, &begin_s, sizeof begin_s, offset_of(record)) != sizeof begin_s) return INT64_MAX;
  return begin_s;
}

std::vector<Extremes> PeriodFile::read(std::int64_t from_s, std::int64_t to_s) const {
  std::uint64_t first = 0;
  if (held_.in_order && from_s != INT64_MIN) {
    for (std::uint64_t end = held_.records; first < end;) {
      const std::uint64_t middle = first + (end - first) / 2;
      if (begin_of(middle) < from_s) {
        first = middle + 1;
      } else {
        end = middle;
      }
    }
  }
  std::vector<Extremes> found;
  std::vector<unsigned char> block(kBlockRecords * kRecordBytes);
  for (; first < held_.records; first += kBlockRecords) {
    const std::uint64_t count = std::min<std::uint64_t>(kBlockRecords, held_.records - first);
    if (::pread(fd_, block.data(), count * kRecordBytes, offset_of(first)) != offset_of(count)) break;
    for (std::uint64_t i = 0; i < count; ++i) {
      const Extremes period = period_of(block.data() + i * kRecordBytes);
      if (held_.in_order && period.begin_s >= to_s) return found;
      if (period.begin_s >= from_s && period.begin_s < to_s) found.push_back(period);
    }
  }
  return found;
}

}  // namespace prism::prismweb
