// SPDX-License-Identifier: MIT
#include "tools/prismsim/network_outlet.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace prism::prismsim {
namespace {

using Kind = transport::Received::Kind;
constexpr std::chrono::milliseconds kRetry{100};

}  // namespace

NetworkOutlet::NetworkOutlet(transport::Network network) {
  settings_.network = std::move(network);
  path_ = transport::describe(settings_);
}

bool NetworkOutlet::has_reader() {
  const auto now = std::chrono::steady_clock::now();
  if (!line_ && now >= next_try_) {
    next_try_ = now + kRetry;
    if (auto opened = transport::open(io_, settings_); opened) line_ = std::move(*opened);
  }
  if (!line_) return false;
  std::array<std::uint8_t, 4096> bytes;
  const transport::Received received = line_->read(bytes);
  if (received.kind == Kind::kLost) line_.reset();
  if (received.kind == Kind::kData) unread_.insert(unread_.end(), bytes.begin(), bytes.begin() + received.bytes);
  return line_ && line_->opening().empty();
}

std::size_t NetworkOutlet::write_some(std::span<const std::uint8_t> bytes) {
  if (!line_ || !line_->opening().empty()) return 0;
  const auto written = line_->write(bytes);
  if (!written) line_.reset();
  return written ? *written : 0;
}

std::size_t NetworkOutlet::read_some(std::span<std::uint8_t> bytes) {
  has_reader();
  const std::size_t size = std::min(bytes.size(), unread_.size());
  std::copy_n(unread_.begin(), size, bytes.begin());
  unread_.erase(unread_.begin(), unread_.begin() + static_cast<std::ptrdiff_t>(size));
  return size;
}

void NetworkOutlet::wait_for_room(int milliseconds) { ::poll(nullptr, 0, milliseconds); }

}  // namespace prism::prismsim
