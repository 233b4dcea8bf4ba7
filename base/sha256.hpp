// SPDX-License-Identifier: MIT
// SHA-256 (FIPS 180-4) as 64 hexadecimal digits: the id of models and files.
#pragma once

#include <nettle/sha2.h>

#include <string>
#include <string_view>

#include "base/result.hpp"

namespace prism {

/// Hash of bytes that arrive in pieces.
class Sha256 {
 public:
  Sha256() { sha256_init(&context_); }

  void add(std::string_view bytes);
  /// Hash of all bytes added so far; more may follow.
  std::string hex() const;

 private:
  sha256_ctx context_;
};

std::string sha256_hex(std::string_view bytes);

/// Hash of a file of any size, read in pieces. Errors: as open_input() (file.hpp), a read error.
Result<std::string> sha256_of_file(const std::string& path);

}  // namespace prism
