// SPDX-License-Identifier: MIT
#include "tools/prismweb/gate.hpp"

#include <openssl/evp.h>

#include <array>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <utility>

#include "tools/prismweb/access.hpp"
#include "tools/prismweb/awaiting.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
constexpr int kMostComparing = 8;
constexpr std::size_t kMostKnown = 64;
constexpr std::chrono::seconds kAfterWrong{1};

}  // namespace

Gate::Gate(asio::io_context& io, PasswordHashes hashes)
    : io_(io), hashes_(std::move(hashes)), salt_(asks() ? make_token() : "") {}

std::string Gate::digest_of(const std::string& authorization) const {
  const std::string text = salt_ + authorization;
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  ::EVP_Digest(text.data(), text.size(), digest.data(), &size, ::EVP_sha256(), nullptr);
  return {digest.begin(), digest.begin() + size};
}

asio::awaitable<bool> Gate::lets_in(std::string authorization) {
  const auto given = basic_of(authorization);
  if (!given) co_return false;
  const std::string digest = digest_of(authorization);
  if (known_.contains(digest)) co_return true;
  if (comparing_ >= kMostComparing) co_return false;
  ++comparing_;
  const auto own = hashes_.find(given->first);
  const std::string hash = own != hashes_.end() ? own->second : hashes_.begin()->second;
  const auto right = std::make_shared<bool>(false);
  const auto compared = std::make_shared<asio::steady_timer>(io_, asio::steady_timer::time_point::max());
  const auto compare = [&io = io_, password = given->second, hash, right, compared] {
    const bool same = is_password(password, hash);
    asio::post(io, [same, right, compared] {
      *right = same;
      compared->cancel();
    });
  };
  asio::post(thread_, compare);
  co_await compared->async_wait(kUse);
  const bool lets = *right && own != hashes_.end();
  if (!lets) {
    compared->expires_after(kAfterWrong);
    co_await compared->async_wait(kUse);
  } else {
    if (known_.size() >= kMostKnown) known_.clear();
    known_.insert(digest);
  }
  --comparing_;
  co_return lets;
}

}  // namespace prism::prismweb
