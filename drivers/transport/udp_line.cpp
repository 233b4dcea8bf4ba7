// SPDX-License-Identifier: MIT
// A line through UDP: a device that sends datagrams to prismd.
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <optional>
#include <utility>

#include "drivers/transport/network_line.hpp"

namespace prism::transport {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

constexpr int kReceiveBytes = 1 << 20;  // a second of the fastest gyro, in the kernel

// The datagram does not reach the device: lost, like any other.
bool is_loss(const error_code& error) {
  return error == asio::error::connection_refused || error == asio::error::network_unreachable ||
         error == asio::error::host_unreachable || error == asio::error::network_down ||
         error == boost::system::errc::operation_not_permitted;
}

class UdpLine : public Transport {
 public:
  /// `from`: the only accepted sender. `peer`: where bytes go; none: to the sender of the last datagram.
  UdpLine(asio::io_context& io, std::string name, const Endpoint& endpoint, std::optional<Address> from,
          std::optional<udp::endpoint> peer)
      : name_(std::move(name)),
        progress_("looking up " + endpoint.host),
        from_(from),
        answers_(!peer),
        peer_(peer),
        port_(endpoint.port),
        look_up_(look_up(endpoint.host)),
        socket_(io),
        timer_(io) {}

  int fd() override { return socket_.is_open() ? socket_.native_handle() : -1; }
  std::string opening() const override { return socket_.is_open() ? "" : progress_; }

  void wait(Ready ready) override {
    if (socket_.is_open()) return socket_.async_wait(udp::socket::wait_read, std::move(ready));
    timer_.expires_after(kLookAgain);
    timer_.async_wait(std::move(ready));
  }

  Received read(std::span<std::uint8_t> buffer) override {
    if (!socket_.is_open()) {
      if (const auto bound = bind_now(); !bound) return {.kind = Received::Kind::kLost, .why = bound.error()};
      return {};
    }
    udp::endpoint sender;
    error_code error;
    const std::size_t size = socket_.receive_from(asio::buffer(buffer.data(), buffer.size()), sender, 0, error);
    if (error == asio::error::would_block || error == asio::error::interrupted ||
        error == asio::error::connection_refused)
      return {};
    if (error) return {.kind = Received::Kind::kLost, .why = error.message()};
    if (from_ && *from_ != host_of(sender.address())) return {};
    if (answers_) peer_ = sender;
    if (size == 0) return {};
    return {Received::Kind::kData, size};
  }

  Result<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    if (!peer_) return make_error(name_, "cannot write: no datagram came yet, and \"from\" has no port");
    error_code error;
    const std::size_t size = socket_.send_to(asio::buffer(bytes.data(), bytes.size()), *peer_, 0, error);
    if (!error) return size;
    if (error == asio::error::would_block || error == asio::error::interrupted) return 0;
    if (is_loss(error)) return bytes.size();
    return make_error(name_, "cannot write: " + error.message());
  }

  bool has_unread() const override {
    error_code error;
    return socket_.is_open() && socket_.available(error) > 0;
  }

  /// Binds if the address is known. Errors: all addresses failed, for this reason.
  tl::expected<void, std::string> bind_now() {
    if (!is_found(look_up_)) return {};
    const auto found = look_up_.get();
    if (!found) return tl::unexpected<std::string>(found.error().text());
    std::string why;
    for (const Address& address : *found) {
      const udp::endpoint here(address, port_);
      error_code error, ignored;
      socket_.open(here.protocol(), error);
      if (!error) socket_.non_blocking(true, error);
      if (!error) socket_.bind(here, error);
      if (!error) socket_.set_option(udp::socket::receive_buffer_size(kReceiveBytes), ignored);
      if (!error) return {};
      socket_.close(ignored);
      why = text_of(address, port_) + ": " + error.message();
    }
    return tl::unexpected<std::string>(why);
  }

 private:
  const std::string name_, progress_;
  const std::optional<Address> from_;
  const bool answers_;  ///< sends to the sender of the last datagram
  std::optional<udp::endpoint> peer_;
  const std::uint16_t port_;
  std::future<Found> look_up_;
  udp::socket socket_;
  asio::steady_timer timer_;  ///< looking up
};

}  // namespace

Result<std::unique_ptr<Transport>> open_udp_line(asio::io_context& io, const Settings& settings) {
  const std::string name = describe(settings);
  const bool listens = settings.network.listens;
  auto endpoint = parse_endpoint(settings.network.address);
  if (!endpoint) return make_error(name, endpoint.error());
  std::optional<Address> from;
  std::optional<udp::endpoint> peer;
  if (const std::string& far = listens ? settings.network.from : settings.network.address; !far.empty()) {
    const auto numeric = parse_numeric_endpoint(far);
    if (!numeric) return make_error(name, numeric.error());
    const Address address = asio::ip::make_address(numeric->host);
    from = host_of(address);
    if (numeric->port != 0) peer.emplace(address, numeric->port);
  }
  if (!listens) *endpoint = {from->is_v4() ? "0.0.0.0" : "::", 0};
  auto line = std::make_unique<UdpLine>(io, name, *endpoint, from, peer);
  if (const auto bound = line->bind_now(); !bound) return make_error(name, bound.error());
  return line;
}

}  // namespace prism::transport
