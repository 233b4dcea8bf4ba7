// SPDX-License-Identifier: MIT
#include "base/sha256.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>

#include "base/file.hpp"

namespace prism {

void Sha256::add(std::string_view bytes) {
  sha256_update(&context_, bytes.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()));
}

std::string Sha256::hex() const {
  sha256_ctx context = context_;  // computing the digest ends the context
  std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest;
  sha256_digest(&context, digest.size(), digest.data());
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

std::string sha256_hex(std::string_view bytes) {
  Sha256 sum;
  sum.add(bytes);
  return sum.hex();
}

Result<std::string> sha256_of_file(const std::string& path) {
  auto file = FileReader::open(path);
  if (!file) return tl::unexpected<Error>(file.error());
  Sha256 sum;
  std::array<char, 1 << 16> piece;
  while (const std::size_t got = file->read(piece)) sum.add({piece.data(), got});
  if (auto good = file->finish(); !good) return tl::unexpected<Error>(good.error());
  return sum.hex();
}

}  // namespace prism
