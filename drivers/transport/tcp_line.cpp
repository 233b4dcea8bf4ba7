// SPDX-License-Identifier: MIT
// A line through TCP: a device server or a device with Ethernet, which prismd connects to or which connects to prismd.
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include "drivers/transport/network_line.hpp"

namespace prism::transport {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kConnectWithin{5};
constexpr int kKeepIdleS = 10, kKeepEveryS = 5, kKeepProbes = 2, kUnansweredMs = 20'000;
constexpr int kBacklog = 4;

std::string why_not_connected(const error_code& error) {
  switch (error.value()) {
    case ECONNREFUSED:
      return "connection refused: no program listens there";
    case ETIMEDOUT:
      return fmt::format("no answer within {} s", kConnectWithin.count());
    case EPERM:
    case EACCES:
      return "not permitted: IPAddressAllow= of the unit, or a firewall";
    default:
      return error.message();
  }
}

void set_option(int fd, int level, int name, int value) { ::setsockopt(fd, level, name, &value, sizeof value); }

void watch_peer(int fd) {
  set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, kKeepIdleS);
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, kKeepEveryS);
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, kKeepProbes);
  set_option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, kUnansweredMs);
}

class TcpLine : public Transport {
 public:
  TcpLine(asio::io_context& io, std::string name, const Endpoint& endpoint, bool listens, std::optional<Address> from)
      : name_(std::move(name)),
        listens_(listens),
        from_(from),
        port_(endpoint.port),
        progress_("looking up " + endpoint.host),
        look_up_(look_up(endpoint.host)),
        acceptor_(io),
        socket_(io),
        timer_(io) {}

  int fd() override { return connected_ ? socket_.native_handle() : -1; }
  std::string opening() const override { return connected_ ? "" : progress_; }
  std::string peer() const override { return peer_; }

  void wait(Ready ready) override {
    if (connected_) return socket_.async_wait(tcp::socket::wait_read, std::move(ready));
    if (acceptor_.is_open()) return acceptor_.async_wait(tcp::acceptor::wait_read, std::move(ready));
    timer_.expires_at(socket_.is_open() ? give_up_ : Clock::now() + kLookAgain);
    timer_.async_wait(ready);
    if (socket_.is_open()) socket_.async_wait(tcp::socket::wait_write, std::move(ready));
  }

  Received read(std::span<std::uint8_t> buffer) override {
    if (!connected_) {
      const auto step = proceed();
      if (!step) return {.kind = Received::Kind::kLost, .why = step.error()};
      return {};
    }
    error_code error;
    const std::size_t size = socket_.read_some(asio::buffer(buffer.data(), buffer.size()), error);
    if (!error) return {Received::Kind::kData, size};
    if (error == asio::error::would_block || error == asio::error::interrupted) return {};
    return {.kind = Received::Kind::kLost,
            .why = error == asio::error::eof ? "the other end closed the connection" : error.message()};
  }

  Result<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    error_code error;
    const std::size_t size = socket_.write_some(asio::buffer(bytes.data(), bytes.size()), error);
    if (!error) return size;
    if (error == asio::error::would_block || error == asio::error::interrupted) return 0;
    return make_error(name_, "cannot write: " + error.message());
  }

  bool has_unread() const override {
    error_code error;
    return connected_ && socket_.available(error) > 0;
  }

  std::string turn_away() override {
    for (int i = 0; connected_ && acceptor_.is_open() && i <= kBacklog; ++i) {
      tcp::endpoint other;
      error_code error;
      const tcp::socket unwanted = acceptor_.accept(other, error);
      if (error) break;
      turned_away_ = host_of(other.address()).to_string();
    }
    return std::exchange(turned_away_, {});
  }

  using Step = tl::expected<void, std::string>;

  /// The next step to a connection, if it is possible now. Errors: all addresses failed, for this reason.
  Step proceed() {
    if (addresses_.empty()) {
      if (!is_found(look_up_)) return {};
      auto found = look_up_.get();
      if (!found) return tl::unexpected<std::string>(found.error().text());
      addresses_ = std::move(*found);
    }
    for (std::string why;; ++next_) {
      if (next_ == addresses_.size()) return tl::unexpected<std::string>(why);
      const error_code error = listens_ ? listen_at(addresses_[next_]) : connect_to(addresses_[next_]);
      if (!error) connected();
      if (!error || error == asio::error::in_progress) return {};
      why = text_of(addresses_[next_], port_) + ": " + (listens_ ? error.message() : why_not_connected(error));
      error_code ignored;
      socket_.close(ignored);
      acceptor_.close(ignored);
    }
  }

 private:
  // Call it again while it returns in_progress.
  error_code connect_to(const Address& address) {
    const tcp::endpoint there(address, port_);
    error_code error;
    if (!socket_.is_open()) {
      socket_.open(there.protocol(), error);
      if (!error) socket_.non_blocking(true, error);
      if (error) return error;
      give_up_ = Clock::now() + kConnectWithin;
      progress_ = "connecting to " + text_of(address, port_);
    }
    // Asio's connect waits. The kernel's, if called again, returns the result.
    if (::connect(socket_.native_handle(), there.data(), static_cast<socklen_t>(there.size())) == 0) {
      // On this host, a connection to a port that no program listens on can connect to itself: the kernel chose the
      // same port for this end.
      return socket_.local_endpoint(error) == there ? asio::error::connection_refused : error;
    }
    if (errno != EINPROGRESS && errno != EALREADY && errno != EINTR) return {errno, boost::system::system_category()};
    return Clock::now() < give_up_ ? asio::error::in_progress : asio::error::timed_out;
  }

  // Call it again while it returns in_progress.
  error_code listen_at(const Address& address) {
    const tcp::endpoint here(address, port_);
    error_code error;
    if (!acceptor_.is_open()) {
      acceptor_.open(here.protocol(), error);
      if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
      if (!error) acceptor_.non_blocking(true, error);
      if (!error) acceptor_.bind(here, error);
      if (!error) acceptor_.listen(kBacklog, error);
      if (error) return error;
      progress_ = "waiting for a connection to " + text_of(address, port_);
    }
    tcp::endpoint there;
    tcp::socket accepted = acceptor_.accept(there, error);
    if (error == asio::error::would_block || error == asio::error::connection_aborted) return asio::error::in_progress;
    if (error) return error;
    const Address host = host_of(there.address());
    if (from_ && *from_ != host) {
      turned_away_ = host.to_string();
      return asio::error::in_progress;
    }
    peer_ = host.to_string();
    socket_ = std::move(accepted);
    socket_.non_blocking(true, error);
    return error;
  }

  void connected() {
    connected_ = true;
    timer_.cancel();
    watch_peer(socket_.native_handle());
  }

  const std::string name_;
  const bool listens_;
  const std::optional<Address> from_;
  const std::uint16_t port_;
  std::string progress_, peer_, turned_away_;
  std::future<Found> look_up_;
  std::vector<Address> addresses_;  ///< empty: not known yet
  std::size_t next_ = 0;            ///< the one of the addresses that is tried
  tcp::acceptor acceptor_;
  tcp::socket socket_;
  asio::steady_timer timer_;
  Clock::time_point give_up_;  ///< connecting
  bool connected_ = false;
};

}  // namespace

Result<std::unique_ptr<Transport>> open_tcp_line(asio::io_context& io, const Settings& settings) {
  const std::string name = describe(settings);
  const auto endpoint = parse_endpoint(settings.network.address);
  if (!endpoint) return make_error(name, endpoint.error());
  std::optional<Address> from;
  if (const std::string& only = settings.network.from; !only.empty()) {
    const auto numeric = parse_numeric_endpoint(only);
    if (!numeric) return make_error(name, numeric.error());
    from = host_of(asio::ip::make_address(numeric->host));
  }
  auto line = std::make_unique<TcpLine>(io, name, *endpoint, settings.network.listens, from);
  if (const auto begun = line->proceed(); !begun) return make_error(name, begun.error());
  return line;
}

}  // namespace prism::transport
