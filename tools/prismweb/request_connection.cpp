// SPDX-License-Identifier: MIT
#include "tools/prismweb/request_connection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <charconv>
#include <utility>
#include <vector>

#include "tools/prismweb/awaiting.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kMaxLineBytes = 32 << 20, kKeptBytes = 256 << 10, kMaxPending = 256;

// {"jsonrpc":"2.0","id":17,"result":…} → 17 and `"result":…`.
bool split_answer(std::string_view line, std::uint64_t& id, std::string_view& member) {
  constexpr std::string_view kHead = R"({"jsonrpc":"2.0","id":)";
  if (!line.starts_with(kHead) || !line.ends_with('}')) return false;
  const char* const first = line.data() + kHead.size();
  const auto [end, error] = std::from_chars(first, line.data() + line.size(), id);
  if (error != std::errc() || end == line.data() + line.size() || *end != ',') return false;
  member = line.substr(static_cast<std::size_t>(end + 1 - line.data()));
  member.remove_suffix(1);
  return true;
}

}  // namespace

RequestConnection::RequestConnection(asio::io_context& io, std::string path)
    : io_(io), path_(std::move(path)), socket_(io) {}

asio::awaitable<bool> RequestConnection::connect() {
  socket_ = Protocol::socket(io_);
  const Protocol::endpoint there(path_);
  const auto [error] = co_await socket_.async_connect(there, kUse);
  if (!error) next();
  co_return !error;
}

asio::awaitable<void> RequestConnection::read(OnLine on_other_line) {
  std::string pending;
  std::vector<char> buffer(256 << 10);
  const auto space = asio::buffer(buffer);
  for (std::size_t searched = 0;;) {
    const auto [error, size] = co_await socket_.async_read_some(space, kUse);
    if (error) break;
    pending.append(buffer.data(), size);
    std::size_t begin = 0;
    for (std::size_t end; (end = pending.find('\n', std::max(begin, searched))) != std::string::npos; begin = end + 1)
      read_line(std::string_view(pending).substr(begin, end - begin), on_other_line);
    pending.erase(0, begin);
    if (pending.size() < kKeptBytes && pending.capacity() > kKeptBytes) pending.shrink_to_fit();
    searched = pending.size();
    if (pending.size() > kMaxLineBytes) break;
  }
}

void RequestConnection::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

bool RequestConnection::call(std::string_view method, const std::string& params, Answer answer, int protocol) {
  if (pending_.size() >= kMaxPending) return false;
  pending_.push_back({std::string(method), params, std::move(answer), Clock::now() + kResponseTimeout, protocol});
  next();
  return true;
}

void RequestConnection::next() {
  if (current_id_ != 0 || writing_ || pending_.empty() || !socket_.is_open()) return;
  current_id_ = ++last_id_;
  const PendingRequest& request = pending_.front();
  line_ = fmt::format(R"({{"jsonrpc":"2.0","id":{},"method":"{}","params":{},"protocol":{}}})"
                      "\n",
                      current_id_, request.method, request.params, request.protocol);
  writing_ = true;
  asio::async_write(socket_, asio::buffer(line_), [this](const boost::system::error_code& error, std::size_t) {
    writing_ = false;
    if (!error) next();  // read() also notices an error
  });
}

void RequestConnection::read_line(std::string_view line, const OnLine& on_other_line) {
  std::uint64_t id = 0;
  std::string_view member;
  if (!split_answer(line, id, member)) return on_other_line(line);
  if (id != current_id_ || pending_.empty()) return;
  const PendingRequest request = std::move(pending_.front());
  pending_.pop_front();
  current_id_ = 0;
  if (request.answer) request.answer(member);
  next();
}

void RequestConnection::expire(std::string_view member) {
  const auto now = Clock::now();
  std::vector<Answer> late;
  for (PendingRequest& request : pending_) {
    if (request.answer && request.until < now) late.push_back(std::exchange(request.answer, nullptr));
  }
  // The first request stays if it was sent: its response is still to come.
  const auto first = pending_.begin() + (current_id_ != 0 && !pending_.empty() ? 1 : 0);
  const auto kept =
      std::remove_if(first, pending_.end(), [](const PendingRequest& request) { return !request.answer; });
  pending_.erase(kept, pending_.end());
  for (const Answer& answer : late) answer(member);
}

void RequestConnection::end(std::string_view member) {
  close();
  const auto requests = std::exchange(pending_, {});
  current_id_ = 0;
  for (const PendingRequest& request : requests) {
    if (request.answer) request.answer(member);
  }
}

}  // namespace prism::prismweb
