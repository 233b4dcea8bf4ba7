// SPDX-License-Identifier: MIT
#include "tools/prismweb/passwords.hpp"

#include <crypt.h>
#include <fmt/format.h>
#include <openssl/evp.h>

#include <cctype>
#include <memory>
#include <vector>

#include "base/escape.hpp"
#include "base/outside_text.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/secret_file.hpp"

namespace prism::prismweb {
namespace {

constexpr std::size_t kMaxPasswordBytes = 72, kHashBytes = 60;
constexpr unsigned long kCost = 11;
constexpr int kMinCost = 4, kMaxCost = 15;  // minimum of bcrypt; 15 takes seconds per comparison

constexpr std::string_view kAlphabet = "./ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789";

// $2b$CC$, 22 characters of salt (128 of 132 bits), 31 of hash (184 of 186 bits). libcrypt writes the unused bits as 0;
// a hash with other bits matches no password.
bool is_bcrypt(std::string_view hash) {
  if (hash.size() != kHashBytes || !(hash.starts_with("$2b$") || hash.starts_with("$2y$")) || hash[6] != '$')
    return false;
  const std::string_view cost = hash.substr(4, 2), code = hash.substr(7);
  if (cost.find_first_not_of("0123456789") != std::string_view::npos) return false;
  const int rounds = 10 * (cost[0] - '0') + (cost[1] - '0');
  if (rounds < kMinCost || rounds > kMaxCost) return false;
  if (code.find_first_not_of(kAlphabet) != std::string_view::npos) return false;
  if (kAlphabet.find(code[21]) % 16 != 0 || kAlphabet.find(code.back()) % 4 != 0) return false;
  return ::crypt_checksalt(std::string(hash).c_str()) == CRYPT_SALT_OK;
}

std::string hashed(const std::string& password, const std::string& setting) {
  const auto data = std::make_unique<crypt_data>();
  const char* const hash = ::crypt_r(password.c_str(), setting.c_str(), data.get());
  return hash != nullptr ? hash : "";
}

}  // namespace

Result<PasswordHashes> parse_passwords(std::string_view text, const std::string& path) {
  PasswordHashes hashes;
  int number = 0;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    ++number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    const std::size_t colon = line.find(':');
    const std::string where = fmt::format("{}:{}", path, number);
    if (colon == 0 || colon == std::string_view::npos || !is_bcrypt(line.substr(colon + 1)))
      return make_error(where, fmt::format("expected NAME:HASH with a bcrypt hash ($2b$ or $2y$) of cost {} to {}; "
                                           "\"prismweb --hash-password\" writes one",
                                           kMinCost, kMaxCost));
    const std::string name(line.substr(0, colon));
    if (const auto valid = check_text(TextRule::kText, name, where); !valid)
      return tl::unexpected<Error>(valid.error());
    if (!hashes.emplace(name, line.substr(colon + 1)).second)
      return make_error(where, fmt::format("found \"{}\" twice", shortened(name)));
  }
  if (hashes.empty()) return make_error(path, "found no users, expected lines NAME:HASH");
  return hashes;
}

Result<PasswordHashes> load_passwords(const std::string& path) {
  const Result<std::string> text = read_secret_file(path);
  if (!text) return tl::unexpected<Error>(text.error());
  return parse_passwords(*text, path);
}

bool is_password(const std::string& password, const std::string& hash) {
  const bool is_complete = password.size() <= kMaxPasswordBytes && password.find('\0') == std::string::npos;
  return is_complete && is_secret(hashed(password, hash), hash);  // bcrypt ignores the rest of a longer one
}

Result<std::string> hash_password(const std::string& password) {
  if (password.empty() || password.size() > kMaxPasswordBytes)
    return make_error("--hash-password", fmt::format("found a password of {} bytes, expected 1 to {}", password.size(),
                                                     kMaxPasswordBytes));
  if (password.find('\0') != std::string::npos)
    return make_error("--hash-password", "found a NUL byte in the password; bcrypt ignores the bytes after it");
  char setting[CRYPT_GENSALT_OUTPUT_SIZE];
  if (::crypt_gensalt_rn("$2b$", kCost, nullptr, 0, setting, sizeof setting) == nullptr)
    return make_error("--hash-password", "libcrypt cannot create a bcrypt salt");
  std::string hash = hashed(password, setting);
  if (!is_bcrypt(hash)) return make_error("--hash-password", "libcrypt cannot create a bcrypt hash");
  return hash;
}

std::optional<std::pair<std::string, std::string>> basic_of(std::string_view authorization) {
  constexpr std::string_view kScheme = "basic ";
  if (authorization.size() <= kScheme.size() || authorization.size() > 1024) return std::nullopt;
  for (std::size_t i = 0; i < kScheme.size(); ++i) {
    if (std::tolower(static_cast<unsigned char>(authorization[i])) != kScheme[i]) return std::nullopt;
  }
  const std::string_view code = authorization.substr(kScheme.size());
  std::vector<unsigned char> bytes(code.size() / 4 * 3 + 3);
  const int size = ::EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(code.data()),
                                     static_cast<int>(code.size()));
  const int padding = code.ends_with("==") ? 2 : code.ends_with('=') ? 1 : 0;
  if (size < padding) return std::nullopt;
  const std::string text(reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(size - padding));
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  return std::pair(text.substr(0, colon), text.substr(colon + 1));
}

}  // namespace prism::prismweb
