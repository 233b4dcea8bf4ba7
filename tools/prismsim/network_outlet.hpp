// SPDX-License-Identifier: MIT
// The simulated device at the far end of a network line.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "drivers/transport/transport.hpp"
#include "tools/prismsim/outlet.hpp"

namespace prism::prismsim {

class NetworkOutlet : public Outlet {
 public:
  explicit NetworkOutlet(transport::Network network);

  const std::string& path() const override { return path_; }
  bool has_reader() override;
  std::size_t write_some(std::span<const std::uint8_t> bytes) override;
  std::size_t read_some(std::span<std::uint8_t> bytes) override;
  void wait_for_room(int milliseconds) override;
  bool is_drained() override { return true; }

 private:
  transport::Settings settings_;
  std::string path_;
  boost::asio::io_context io_;  ///< nothing waits for it
  std::unique_ptr<transport::Transport> line_;
  std::chrono::steady_clock::time_point next_try_;
  std::vector<std::uint8_t> unread_;
};

}  // namespace prism::prismsim
