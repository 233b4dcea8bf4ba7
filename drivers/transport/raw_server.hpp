// SPDX-License-Identifier: MIT
// Passes the bytes of a line on to any number of readers through TCP.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "base/result.hpp"
#include "drivers/transport/wait_set.hpp"

namespace prism::transport {

/// Readers only: their own bytes are discarded. No call waits. A reader that is more than its socket buffer (1 MiB)
/// behind is disconnected.
class RawServer {
 public:
  static constexpr std::size_t kMostReaders = 64;

  /// `address`: IP address and port, as in the configuration. Errors: the address and the reason.
  static Result<std::unique_ptr<RawServer>> open(const std::string& address);

  /// For poll(2): readable when a reader comes or goes; then call accept_and_forget().
  int fd() const { return waits_.fd(); }
  void accept_and_forget();
  void send(std::span<const std::uint8_t> bytes);

  std::size_t readers() const { return readers_.size(); }
  /// Disconnected because they were too slow.
  std::uint64_t dropped() const { return dropped_; }
  const std::string& address() const { return address_; }

 private:
  RawServer(std::string address, Descriptor listener);

  const std::string address_;
  WaitSet waits_;
  Descriptor listener_;
  std::vector<Descriptor> readers_;
  bool listening_ = true;  ///< false: no descriptor was left; again after the next bytes
  std::uint64_t dropped_ = 0;
};

}  // namespace prism::transport
