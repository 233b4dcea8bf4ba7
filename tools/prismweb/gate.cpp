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
constexpr std::size_t kMostComparing = 8;
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

struct Gate::Comparison {
  explicit Comparison(asio::io_context& io) : done(io, asio::steady_timer::time_point::max()) {}
  bool right = false;
  asio::steady_timer done;  ///< cancelled when it is known
};

std::shared_ptr<Gate::Comparison> Gate::compare(const std::string& digest, const std::string& name,
                                                const std::string& password) {
  if (const auto same = comparisons_.find(digest); same != comparisons_.end()) return same->second;
  if (comparisons_.size() >= kMostComparing) return nullptr;
  auto comparison = std::make_shared<Comparison>(io_);
  comparisons_.emplace(digest, comparison);
  const auto own = hashes_.find(name);
  const bool is_known = own != hashes_.end();
  // A name that is not there takes as long.
  asio::post(thread_, [this, digest, password, hash = (is_known ? own : hashes_.begin())->second, is_known] {
    const bool right = is_password(password, hash) && is_known;
    asio::post(io_, [this, digest, right] {
      const auto found = comparisons_.extract(digest);
      found.mapped()->right = right;
      found.mapped()->done.cancel();
      if (!right) return;
      if (known_.size() >= kMostKnown) known_.clear();
      known_.insert(digest);
    });
  });
  return comparison;
}

asio::awaitable<Pass> Gate::lets_in(std::string authorization) {
  const auto given = basic_of(authorization);
  if (!given) co_return Pass::kNo;
  const std::string digest = digest_of(authorization);
  if (known_.contains(digest)) co_return Pass::kYes;
  const auto comparison = compare(digest, given->first, given->second);
  if (!comparison) co_return Pass::kBusy;
  co_await comparison->done.async_wait(kUse);
  if (comparison->right) co_return Pass::kYes;
  asio::steady_timer pause(io_, kAfterWrong);
  co_await pause.async_wait(kUse);
  co_return Pass::kNo;
}

}  // namespace prism::prismweb
