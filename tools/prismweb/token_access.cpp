// SPDX-License-Identifier: MIT
#include "tools/prismweb/token_access.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "tools/prismweb/access.hpp"
#include "tools/prismweb/secret_file.hpp"

namespace prism::prismweb {
namespace {

constexpr std::size_t kMinTokenLetters = 32;  // make_token() returns more

std::string runtime_path(int port, std::string_view ending) {
  std::string directory = "/tmp";
  for (const char* name : {"XDG_RUNTIME_DIR", "RUNTIME_DIRECTORY"}) {
    const char* const value = std::getenv(name);
    if (value != nullptr && *value != '\0') directory = value;
  }
  return fmt::format("{}/prismweb-{}.{}", directory, port, ending);
}

std::string stored_token(const std::string& path) {
  std::string token = read_private_file(path).value_or("");
  if (token.empty() || token.back() != '\n') return "";
  token.pop_back();
  const bool is_complete =
      token.size() >= kMinTokenLetters && token.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  return is_complete ? token : "";
}

std::int64_t now_s() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

}  // namespace

TokenAccess::TokenAccess(int port, bool is_tls)
    : cookie_name_(fmt::format("prism-{}", port)),
      sessions_path_(runtime_path(port, "sessions")),
      is_tls_(is_tls),
      address_token_(make_token()),
      sessions_(SessionList::parse(read_private_file(sessions_path_).value_or(""))) {}

Result<std::unique_ptr<TokenAccess>> TokenAccess::open(int port, bool is_tls) {
  std::unique_ptr<TokenAccess> access(new TokenAccess(port, is_tls));
  const std::string path = runtime_path(port, "token");
  access->program_token_ = stored_token(path);
  if (access->program_token_.empty()) {
    access->program_token_ = make_token();
    if (access->program_token_.empty()) return make_error("token", "the system returns no random numbers");
    const auto written = write_private_file(path, access->program_token_ + "\n");
    if (!written) return tl::unexpected<Error>(written.error());
  }
  return access;
}

bool TokenAccess::renew_address_token() {
  if (!address_token_.empty()) return false;
  address_token_ = make_token();
  return true;
}

bool TokenAccess::is_authenticated(const Request& request) const {
  if (is_program_token(bearer_of(request.authorization))) return true;
  if (!is_own_page(request.origin, request.sec_fetch_site, request.host, is_tls_)) return false;
  const auto values = cookie_values(request.cookie, cookie_name_);
  return std::any_of(values.begin(), values.end(),
                     [&](std::string_view value) { return sessions_.contains(value, now_s()); });
}

std::optional<std::string> TokenAccess::begin_session(std::string_view token) {
  if (!is_secret(token, address_token_)) return std::nullopt;
  const std::string cookie = make_token();
  if (cookie.empty()) return std::nullopt;
  address_token_.clear();
  sessions_.add(cookie, now_s());
  if (const auto written = write_private_file(sessions_path_, sessions_.text()); !written)
    fmt::print(stderr, "prismweb: {}; this session will not survive a restart\n", written.error().text());
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}{}", cookie_name_, cookie,
                     std::chrono::seconds(SessionList::kLifetime).count(), is_tls_ ? "; Secure" : "");
}

}  // namespace prism::prismweb
