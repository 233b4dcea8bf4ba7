// SPDX-License-Identifier: MIT
#include "tools/client/async_connection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <charconv>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/json_member.hpp"

namespace prism::client {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMaxLineBytes = 32 << 20, kMaxRoom = 256 << 10, kMaxPending = 256;

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

// The same for another order or other blanks.
bool parse_answer(const nlohmann::json& message, std::uint64_t& id, std::string& member) {
  const nlohmann::json& number = prism::member(message, "id");
  if (!number.is_number_unsigned()) return false;
  id = number.get<std::uint64_t>();
  const char* const key = message.contains("error") ? "error" : "result";
  member = fmt::format("\"{}\":{}", key, json_text(prism::member(message, key)));
  return true;
}

}  // namespace

void AsyncConnection::open(const std::string& path, OnLine on_other_line, OnEnd on_end) {
  on_other_line_ = std::move(on_other_line);
  on_end_ = std::move(on_end);
  open_ = true;
  const auto on_connected = [self = shared_from_this()](error_code error) {
    if (!self->open_) return;
    if (error) return self->disconnect(error.message());
    self->connected_ = true;
    self->read();
    self->send_next();
  };
  asio::local::stream_protocol::endpoint endpoint;
  try {
    endpoint = path;
  } catch (const boost::system::system_error& error) {  // the path is too long
    asio::post(socket_.get_executor(),
               [self = shared_from_this(), reason = error.code().message()] { self->disconnect(reason); });
    return;
  }
  socket_.async_connect(endpoint, on_connected);
}

void AsyncConnection::close() {
  open_ = false;
  on_end_ = nullptr;
  pending_.clear();
  error_code ignored;
  socket_.close(ignored);
}

bool AsyncConnection::call(std::string_view method, const std::string& params, Answer answer) {
  if (pending_.size() >= kMaxPending) return false;
  pending_.push_back({std::string(method), params, std::move(answer), Clock::now() + kResponseTimeout});
  send_next();
  return true;
}

void AsyncConnection::send_next() {
  if (current_id_ != 0 || writing_ || pending_.empty() || !open_ || !connected_) return;
  current_id_ = ++last_id_;
  const PendingRequest& request = pending_.front();
  line_ = fmt::format(R"({{"jsonrpc":"2.0","id":{},"method":"{}","params":{},"protocol":{}}})"
                      "\n",
                      current_id_, request.method, request.params, config::kProtocol);
  writing_ = true;
  asio::async_write(socket_, asio::buffer(line_), [self = shared_from_this()](error_code error, std::size_t) {
    self->writing_ = false;
    if (!error) self->send_next();  // read() also notices an error
  });
}

void AsyncConnection::read() {
  const std::size_t before = received_.size();
  received_.resize(before + room_);
  const auto buffer = asio::buffer(received_.data() + before, room_);
  socket_.async_read_some(buffer, [self = shared_from_this(), before](error_code error, std::size_t size) {
    if (!self->open_) return;
    self->received_.resize(before + size);
    if (error) return self->disconnect(error == asio::error::eof ? "prismd closed the connection" : error.message());
    self->take_lines();
    if (self->received_.size() > kMaxLineBytes)
      self->disconnect("sent a line that is too long; is this prismd's socket?");
    if (!self->open_) return;
    self->adapt_room(size);
    self->read();
  });
}

void AsyncConnection::take_lines() {
  std::size_t begin = 0;
  for (std::size_t end; (end = received_.find('\n', std::max(begin, searched_))) != std::string::npos;
       begin = end + 1) {
    read_line(std::string_view(received_).substr(begin, end - begin));
    if (!open_) return;
  }
  received_.erase(0, begin);
  searched_ = received_.size();
}

// There may be 1000 connections, most of them idle.
void AsyncConnection::adapt_room(std::size_t read_bytes) {
  if (read_bytes == room_) {
    room_ = std::min(4 * room_, kMaxRoom);
  } else if (read_bytes < room_ / 8 && room_ > kMinRoom) {
    room_ = kMinRoom;
    if (received_.size() < kMinRoom) received_.shrink_to_fit();
  }
}

void AsyncConnection::read_line(std::string_view line) {
  constexpr std::string_view kNotification = R"({"jsonrpc":"2.0","method":)";
  std::uint64_t id = 0;
  std::string_view member;
  std::string text;
  if (!split_answer(line, id, member)) {
    if (line.starts_with(kNotification)) return pass_on(line);
    const auto message = parse_json_line(line);
    if (!message || !message->is_object())
      return disconnect("sent \"" + shortened(line, 40) + "\", expected a JSON object; is this prismd's socket?");
    const nlohmann::json& error = prism::member(*message, "error");  // without an id: the connection is rejected
    if (!error.is_null() && prism::member(*message, "id").is_null())
      return disconnect(text_member(error, "message", "prismd rejected the connection"));
    if (!parse_answer(*message, id, text)) return pass_on(line);
    member = text;
  }
  if (id != current_id_ || pending_.empty()) return;
  const PendingRequest request = std::move(pending_.front());
  pending_.pop_front();
  current_id_ = 0;
  if (request.answer) request.answer(member);
  send_next();
}

void AsyncConnection::pass_on(std::string_view line) {
  if (on_other_line_) on_other_line_(line);
}

void AsyncConnection::expire(std::string_view member) {
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

void AsyncConnection::end(std::string_view member) {
  const auto requests = std::exchange(pending_, {});
  close();
  for (const PendingRequest& request : requests) {
    if (request.answer) request.answer(member);
  }
}

void AsyncConnection::disconnect(const std::string& reason) {
  if (!open_) return;
  open_ = false;
  error_code ignored;
  socket_.close(ignored);
  const OnEnd callback = std::exchange(on_end_, nullptr);
  if (callback) callback(reason);
}

}  // namespace prism::client
