// SPDX-License-Identifier: MIT
#include "tools/prismweb/token_access.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "base/sha256.hpp"
#include "tools/prismweb/access.hpp"
#include "tools/prismweb/secret_file.hpp"

namespace prism::prismweb {
namespace {

constexpr std::size_t kMinTokenLetters = 32;  // make_token() returns more

constexpr std::chrono::hours kCookieAge{30 * 24};

std::string token_path(int port) {
  std::string directory = "/tmp";
  for (const char* name : {"XDG_RUNTIME_DIR", "RUNTIME_DIRECTORY"}) {
    const char* const value = std::getenv(name);
    if (value != nullptr && *value != '\0') directory = value;
  }
  return fmt::format("{}/prismweb-{}.token", directory, port);
}

std::string stored_token(const std::string& path) {
  std::string token = read_private_file(path).value_or("");
  if (token.empty() || token.back() != '\n') return "";
  token.pop_back();
  const bool is_complete =
      token.size() >= kMinTokenLetters && token.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  return is_complete ? token : "";
}

}  // namespace

TokenAccess::TokenAccess(int port, std::string program_token)
    : cookie_name_(fmt::format("prism-{}", port)),
      program_token_(std::move(program_token)),
      cookie_(sha256_hex("cookie " + program_token_)),
      address_token_(make_token()) {}

Result<std::unique_ptr<TokenAccess>> TokenAccess::open(int port) {
  const std::string path = token_path(port);
  std::string token = stored_token(path);
  if (token.empty()) {
    token = make_token();
    if (token.empty()) return make_error("token", "the system returns no random numbers");
    const auto written = write_private_file(path, token + "\n");
    if (!written) return tl::unexpected<Error>(written.error());
  }
  return std::unique_ptr<TokenAccess>(new TokenAccess(port, std::move(token)));
}

bool TokenAccess::renew_address_token() {
  if (!address_token_.empty()) return false;
  address_token_ = make_token();
  return true;
}

bool TokenAccess::is_authenticated(const Request& request) const {
  if (is_program_token(bearer_of(request.authorization))) return true;
  if (!is_own_page(request.origin, request.sec_fetch_site, request.host)) return false;
  const auto values = cookie_values(request.cookie, cookie_name_);
  return std::any_of(values.begin(), values.end(), [&](std::string_view value) { return is_secret(value, cookie_); });
}

std::optional<std::string> TokenAccess::begin_session(std::string_view token) {
  if (!is_secret(token, address_token_)) return std::nullopt;
  address_token_.clear();
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}", cookie_name_, cookie_,
                     std::chrono::seconds(kCookieAge).count());
}

}  // namespace prism::prismweb
