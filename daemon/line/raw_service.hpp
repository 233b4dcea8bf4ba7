// SPDX-License-Identifier: MIT
// Serves the raw bytes of a line while the daemon runs, independent of the line's state.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/alarm.hpp"
#include "daemon/pipeline/notice.hpp"
#include "drivers/transport/raw_server.hpp"

namespace prism::line {

class RawService {
 public:
  using Tell = std::function<void(pipeline::Severity, const std::string& text)>;

  RawService(boost::asio::io_context& io, Tell tell) : io_(io), tell_(std::move(tell)) {}

  /// Serves at this address from now on; empty: serves nothing. An address that cannot be used is reported once.
  void use(const std::string& address);
  /// Tries such an address again.
  void retry();
  void send(std::span<const std::uint8_t> bytes);

 private:
  struct Open {
    Open(boost::asio::io_context& io, std::unique_ptr<transport::RawServer> opened)
        : server(std::move(opened)), ready(io, server->fd()) {}
    ~Open() { ready.release(); }
    Open(const Open&) = delete;
    Open& operator=(const Open&) = delete;

    std::unique_ptr<transport::RawServer> server;
    boost::asio::posix::stream_descriptor ready;
  };
  void listen(const std::shared_ptr<Open>& open);

  boost::asio::io_context& io_;
  const Tell tell_;
  std::string address_;
  Alarm fault_;
  std::shared_ptr<Open> open_;
  std::uint64_t dropped_ = 0;
};

}  // namespace prism::line
