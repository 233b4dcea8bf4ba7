// SPDX-License-Identifier: MIT
#include "tools/prismweb/access.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nettle/memops.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ranges>
#include <utility>

#include "base/file.hpp"
#include "base/sha256.hpp"

namespace prism::prismweb {
namespace {

constexpr std::size_t kTokenBytes = 32;
constexpr std::chrono::hours kCookieAge{30 * 24};

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small;
}

// The host of a Host field or of an origin's authority, in lower case and without port: "[::1]:8467" → "[::1]". Empty
// if the port or the bracket is invalid.
std::string host_of(std::string_view authority) {
  const bool bracketed = authority.starts_with('[');
  const std::size_t bracket = authority.find(']');
  if (bracketed && bracket == std::string_view::npos) return "";
  const std::size_t end = bracketed ? bracket + 1 : std::min(authority.find(':'), authority.size());
  const std::string_view port = authority.substr(end);
  const bool is_port = port.empty() || (port.size() <= 6 && port.front() == ':' &&
                                        port.find_first_not_of("0123456789", 1) == std::string_view::npos);
  std::string host = is_port ? lower(authority.substr(0, end)) : "";
  if (host.ends_with('.')) host.pop_back();
  return host;
}

// True if a page of this server sent the request; only then its cookie is accepted. Browsers also send the cookie with
// requests from pages on other ports of this host.
bool is_own_page(const Request& request) {
  const auto& site = request.sec_fetch_site;
  if (request.origin.empty() && site.empty()) return false;
  if (!site.empty() && site != "same-origin" && site != "none") return false;
  return request.origin.empty() || lower(request.origin) == lower("http://" + request.host);
}

// The token of "Bearer TOKEN"; empty for another scheme.
std::string_view bearer_of(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  if (authorization.size() <= kScheme.size() || lower(authorization.substr(0, kScheme.size())) != kScheme) return {};
  return authorization.substr(kScheme.size());
}

// In constant time. An empty `secret` never matches.
bool is_secret(std::string_view given, std::string_view secret) {
  return !secret.empty() && given.size() == secret.size() &&
         ::nettle_memeql_sec(given.data(), secret.data(), secret.size()) == 1;
}

// There are several values if the cookie was set for several paths.
bool has_cookie(std::string_view field, std::string_view name, std::string_view secret) {
  for (const auto part : std::views::split(field, ';')) {
    std::string_view pair(part.begin(), part.end());
    pair.remove_prefix(std::min(pair.find_first_not_of(" \t"), pair.size()));
    if (pair.starts_with(name) && pair.substr(name.size()).starts_with('=') &&
        is_secret(pair.substr(name.size() + 1), secret))
      return true;
  }
  return false;
}

// Empty if the system has no random numbers.
std::string make_token() {
  std::array<unsigned char, kTokenBytes> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return "";
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

std::string token_path(int port) {
  std::string directory = "/tmp";
  for (const char* name : {"XDG_RUNTIME_DIR", "RUNTIME_DIRECTORY"}) {
    const char* const value = std::getenv(name);
    if (value != nullptr && *value != '\0') directory = value;
  }
  return fmt::format("{}/prismweb-{}.token", directory, port);
}

// Empty unless the file is complete, of this user, with mode 0600 and without further hard links.
std::string stored_token(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY));
  struct stat found {};
  const bool is_private = file.get() >= 0 && ::fstat(file.get(), &found) == 0 && S_ISREG(found.st_mode) &&
                          found.st_uid == ::geteuid() && (found.st_mode & 07777) == 0600 && found.st_nlink == 1;
  std::string token(2 * kTokenBytes + 1, '\0');
  const bool is_complete = is_private &&
                           ::read(file.get(), token.data(), token.size()) == static_cast<ssize_t>(token.size()) &&
                           token.back() == '\n';
  token.pop_back();
  return is_complete && token.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos ? token : "";
}

// Replaces the file by a new one of mode 0600. Never writes to an existing file or through a link.
Result<void> write_token(const std::string& path, const std::string& token) {
  const std::string temporary = fmt::format("{}.{}.new", path, ::getpid());
  ::unlink(temporary.c_str());  // left by a process that crashed
  const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  const bool is_written = file.get() >= 0 && ::fchmod(file.get(), 0600) == 0 && write_all(file.get(), token + "\n") &&
                          std::rename(temporary.c_str(), path.c_str()) == 0;
  if (is_written) return {};
  const int error = errno;
  ::unlink(temporary.c_str());
  return make_error(path, fmt::format("cannot be written: {}", std::strerror(error)));
}

}  // namespace

Access::Access(std::vector<std::string> hosts) : hosts_(std::move(hosts)) {
  for (std::string& host : hosts_) host = lower(host);
  for (const char* const host : {"localhost", "127.0.0.1", "[::1]"}) hosts_.emplace_back(host);
}

Result<Access> Access::with_token(std::vector<std::string> hosts, const std::string& address, int port) {
  Access access(std::move(hosts));
  in6_addr v6{};  // the address is written as by browsers
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool is_v6 = ::inet_pton(AF_INET6, address.c_str(), &v6) == 1;
  if (is_v6) ::inet_ntop(AF_INET6, &v6, text.data(), text.size());
  access.hosts_.push_back(is_v6 ? fmt::format("[{}]", text.data()) : address);
  const std::string path = token_path(port);
  access.program_token_ = stored_token(path);
  if (!access.has_tokens()) {
    access.program_token_ = make_token();
    if (!access.has_tokens()) return make_error("token", "the system returns no random numbers");
    const auto written = write_token(path, access.program_token_);
    if (!written) return tl::unexpected<Error>(written.error());
  }
  access.cookie_name_ = fmt::format("prism-{}", port);
  access.cookie_ = sha256_hex("cookie " + access.program_token_);
  access.address_token_ = make_token();
  return access;
}

// A page under another name that resolves to this address (DNS rebinding) sends its own name.
bool Access::is_allowed_host(std::string_view authority) const {
  const std::string name = host_of(authority);
  return !name.empty() && std::find(hosts_.begin(), hosts_.end(), name) != hosts_.end();
}

Admission Access::admit(const Request& request, bool needs_token) const {
  if (!is_allowed_host(request.host)) return {421};
  const std::string_view origin = request.origin;
  const std::size_t scheme = origin.starts_with("http://") ? 7 : origin.starts_with("https://") ? 8 : 0;
  if (!origin.empty() && (scheme == 0 || !is_allowed_host(origin.substr(scheme)))) return {403};
  const bool is_known = is_authenticated(request);
  return {needs_token && !is_known ? 401 : 0, is_known};
}

bool Access::is_program_token(std::string_view given) const {
  return !has_tokens() || is_secret(given, program_token_);
}

bool Access::is_authenticated(const Request& request) const {
  if (is_program_token(bearer_of(request.authorization))) return true;
  return is_own_page(request) && has_cookie(request.cookie, cookie_name_, cookie_);
}

bool Access::renew_address_token() {
  if (!has_tokens() || !address_token_.empty()) return false;
  address_token_ = make_token();
  return true;
}

std::optional<std::string> Access::begin_session(const Request& request) {
  if (!is_secret(bearer_of(request.authorization), address_token_)) return std::nullopt;
  address_token_.clear();
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={}", cookie_name_, cookie_,
                     std::chrono::seconds(kCookieAge).count());
}

}  // namespace prism::prismweb
