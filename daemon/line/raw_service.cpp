// SPDX-License-Identifier: MIT
#include "daemon/line/raw_service.hpp"

#include <fmt/format.h>

#include <utility>

namespace prism::line {

using pipeline::Severity;

void RawService::use(const std::string& address) {
  if (address == address_) return;
  address_ = address;
  open_.reset();
  fault_.clear();
  retry();
}

void RawService::retry() {
  if (open_ || address_.empty()) return;
  auto server = transport::RawServer::open(address_);
  if (!server) {
    if (fault_.set(server.error().text())) tell_(Severity::kWarning, fault_.problem() + "; retrying");
    return;
  }
  fault_.clear();
  dropped_ = 0;
  open_ = std::make_shared<Open>(io_, std::move(*server));
  tell_(Severity::kInfo, fmt::format("the raw bytes of the line are served at {}", address_));
  listen(open_);
}

void RawService::listen(const std::shared_ptr<Open>& open) {
  open->ready.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                         [this, weak = std::weak_ptr<Open>(open)](boost::system::error_code error) {
                           const std::shared_ptr<Open> still = weak.lock();
                           if (error || !still) return;
                           still->server->accept_and_forget();
                           listen(still);
                         });
}

void RawService::send(std::span<const std::uint8_t> bytes) {
  if (!open_) return;
  open_->server->send(bytes);
  if (const std::uint64_t dropped = open_->server->dropped(); dropped > dropped_) {
    tell_(Severity::kWarning, fmt::format("{}: a reader of the raw bytes was too slow and was disconnected", address_));
    dropped_ = dropped;
  }
}

}  // namespace prism::line
