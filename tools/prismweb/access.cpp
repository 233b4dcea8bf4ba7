// SPDX-License-Identifier: MIT
#include "tools/prismweb/access.hpp"

#include <fmt/format.h>
#include <nettle/memops.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/address.hpp>
#include <cctype>

namespace prism::prismweb {
namespace {

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small;
}

bool is_port(std::string_view text) {
  return text.empty() || (text.size() <= 6 && text.front() == ':' &&
                          std::all_of(text.begin() + 1, text.end(), [](unsigned char c) { return std::isdigit(c); }));
}

}  // namespace

std::string host_of(std::string_view authority) {
  const bool bracketed = authority.starts_with('[');
  const std::size_t bracket = authority.find(']');
  if (bracketed && bracket == std::string_view::npos) return "";
  const std::size_t end = bracketed ? bracket + 1 : std::min(authority.find(':'), authority.size());
  if (!is_port(authority.substr(end))) return "";
  std::string host = lower(authority.substr(0, end));
  if (host.ends_with('.')) host.pop_back();
  return host;
}

HostList::HostList(const std::string& address, const std::vector<std::string>& more_names)
    : names_{"localhost", "127.0.0.1", "[::1]"} {
  boost::system::error_code error;
  const auto ip = boost::asio::ip::make_address(address, error);  // normalised as by browsers
  if (!error) names_.push_back(ip.is_v4() ? ip.to_string() : "[" + ip.to_string() + "]");
  for (const std::string& name : more_names) names_.push_back(lower(name));
}

bool HostList::allows_host(std::string_view host) const {
  const std::string name = host_of(host);
  return !name.empty() && std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool HostList::allows_origin(std::string_view origin) const {
  if (origin.empty()) return true;
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme)) return allows_host(origin.substr(scheme.size()));
  }
  return false;
}

Result<bool> is_loopback(const std::string& address) {
  boost::system::error_code error;
  const auto ip = boost::asio::ip::make_address(address, error);
  if (error) return make_error("listen", fmt::format("found \"{}\", expected an IP address", address));
  return ip.is_loopback();
}

bool is_own_page(std::string_view origin, std::string_view sec_fetch_site, std::string_view host) {
  if (origin.empty() && sec_fetch_site.empty()) return false;
  if (!sec_fetch_site.empty() && sec_fetch_site != "same-origin" && sec_fetch_site != "none") return false;
  return origin.empty() || lower(origin) == lower(fmt::format("http://{}", host));
}

std::vector<std::string_view> cookie_values(std::string_view field, std::string_view name) {
  std::vector<std::string_view> values;
  while (!field.empty()) {
    std::string_view pair = field.substr(0, field.find(';'));
    field.remove_prefix(std::min(pair.size() + 1, field.size()));
    pair.remove_prefix(std::min(pair.find_first_not_of(" \t"), pair.size()));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos || pair.substr(0, equals) != name) continue;
    values.push_back(pair.substr(equals + 1));
  }
  return values;
}

std::string_view bearer_of(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  if (authorization.size() <= kScheme.size() || lower(authorization.substr(0, kScheme.size())) != kScheme) return {};
  return authorization.substr(kScheme.size());
}

bool is_secret(std::string_view given, std::string_view secret) {
  return !secret.empty() && given.size() == secret.size() &&
         ::nettle_memeql_sec(given.data(), secret.data(), secret.size()) == 1;
}

std::string make_token() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return "";
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

}  // namespace prism::prismweb
