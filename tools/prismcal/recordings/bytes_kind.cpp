// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/bytes_kind.hpp"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "base/file.hpp"
#include "drivers/shown_bytes.hpp"
#include "tools/prismcal/tables/plain_table.hpp"

namespace prism::recordings {

bool is_capture(const std::string& path) {
  auto in = FileReader::open(path);
  std::array<char, 4> magic{};
  if (!in || in->read(magic) != magic.size()) return false;
  std::uint32_t value = 0;
  std::memcpy(&value, magic.data(), sizeof value);
  if constexpr (std::endian::native == std::endian::big) value = __builtin_bswap32(value);
  return value == 0xa1b23c4d || value == 0xa1b2c3d4 || value == 0x4d3cb2a1 || value == 0xd4c3b2a1 ||
         value == 0x0a0d0d0a;
}

Result<std::string> bytes_kind(const std::string& path) {
  if (is_capture(path)) return std::string("capture");
  const auto foreign = tables::foreign_file(path);
  if (!foreign) return tl::unexpected<Error>(foreign.error());
  if (!foreign->empty()) return std::string();
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  std::array<char, drivers::kFirstBytes> bytes{};
  const std::string_view first(bytes.data(), in->read(bytes));
  if (drivers::is_binary(first)) return std::string("bytes");
  const auto sentences = drivers::has_sentences(path, first);
  if (!sentences) return tl::unexpected<Error>(sentences.error());
  return std::string(*sentences ? "log of sentences" : "");
}

}  // namespace prism::recordings
