// SPDX-License-Identifier: MIT
// Any bytes as a capture or a raw byte stream: reading ends, no packet is longer than the file, and a second reading
// returns the same.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/capture_file.hpp"
#include "tests/fuzz/require.hpp"

namespace {

struct Read {
  std::vector<std::int64_t> times;
  std::size_t bytes = 0;
  std::string damage;

  bool operator==(const Read&) const = default;
};

Read read_all(const std::string& path, std::size_t size) {
  auto reader = prism::drivers::CaptureReader::open(path, 4000);
  if (!reader) return {{}, 0, reader.error().text()};
  Read read;
  while (const auto packet = reader->next()) {
    read.times.push_back(packet->time_ns);
    read.bytes += packet->bytes.size();
    require(packet->bytes.size() <= size);
    require(read.times.size() <= size + 1);
  }
  read.damage = reader->tail_damage();
  return read;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = ::memfd_create("capture", MFD_CLOEXEC);
  require(file >= 0 && ::write(file, data, size) == static_cast<ssize_t>(size));
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  const Read once = read_all(path, size), twice = read_all(path, size);
  require(once == twice);
  require(once.bytes <= size);
  for (const char c : once.damage) require(c != '\n');
  ::close(file);
  return 0;
}
