// SPDX-License-Identifier: MIT
#include "drivers/transport/resolver.hpp"

#include <fmt/format.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <system_error>
#include <thread>

namespace prism::transport {
namespace {

namespace ip = boost::asio::ip;
using boost::system::error_code;

std::string why_not_found(const error_code& error) {
  if (error == boost::asio::error::host_not_found) return "no host of this name found";
  if (error == boost::asio::error::host_not_found_try_again) return "the name server does not answer";
  return "cannot be looked up: " + error.message();
}

Found wait_for_name_server(const std::string& host) {
  boost::asio::io_context io;
  error_code error;
  std::vector<Address> addresses;
  for (const auto& entry : ip::tcp::resolver(io).resolve(host, "", error))
    addresses.push_back(entry.endpoint().address());
  if (error) return make_error(host, why_not_found(error));
  return addresses;
}

}  // namespace

// The thread is detached: Asio's own resolver would wait for it at the end of the program.
std::future<Found> look_up(const std::string& host) {
  const auto found = std::make_shared<std::promise<Found>>();
  auto result = found->get_future();
  error_code is_name;
  if (const Address address = ip::make_address(host, is_name); !is_name) {
    found->set_value(std::vector{address});
    return result;
  }
  try {
    std::thread([host, found] { found->set_value(wait_for_name_server(host)); }).detach();
  } catch (const std::system_error& no_thread) {
    found->set_value(make_error(host, std::string("cannot be looked up: ") + no_thread.what()));
  }
  return result;
}

bool is_found(const std::future<Found>& look_up) {
  return look_up.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Address host_of(const Address& address) {
  if (address.is_v4()) return address;
  const ip::address_v6 long_form = address.to_v6();
  if (long_form.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, long_form);
  return ip::address_v6(long_form.to_bytes());
}

std::string text_of(const Address& address, std::uint16_t port) {
  return address.is_v6() ? fmt::format("[{}]:{}", address.to_string(), port)
                         : fmt::format("{}:{}", address.to_string(), port);
}

}  // namespace prism::transport
