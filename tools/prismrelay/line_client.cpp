// SPDX-License-Identifier: MIT
#include "tools/prismrelay/line_client.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"

namespace prism::prismrelay {

using boost::system::error_code;
using nlohmann::json;

void LineClient::open(const std::string& path, Message notification, Gone gone) {
  notification_ = std::move(notification);
  gone_ = std::move(gone);
  open_ = true;
  const auto connected = [self = shared_from_this()](error_code error) {
    if (!self->open_) return;
    if (error) return self->lost(error.message());
    self->connected_ = true;
    self->read();
    if (!self->unsent_.empty()) self->write();
  };
  boost::asio::local::stream_protocol::endpoint endpoint;
  try {
    endpoint = path;
  } catch (const boost::system::system_error& error) {  // longer than an address may be
    const auto told = [self = shared_from_this(), why = std::string(error.code().message())] { self->lost(why); };
    boost::asio::post(socket_.get_executor(), told);
    return;
  }
  socket_.async_connect(endpoint, connected);
}

void LineClient::ask(const char* method, const json& params, Message answer) {
  json request = {{"jsonrpc", "2.0"}, {"id", ++last_id_}, {"method", method}};
  if (!params.is_null()) request["params"] = params;
  asked_[last_id_] = std::move(answer);
  unsent_.push_back(json_text(request) + "\n");
  if (connected_ && unsent_.size() == 1) write();
}

void LineClient::close() {
  open_ = connected_ = false;
  notification_ = nullptr;
  gone_ = nullptr;
  asked_.clear();
  error_code ignored;
  socket_.close(ignored);
}

void LineClient::write() {
  const auto written = [self = shared_from_this()](error_code error, std::size_t) {
    if (!self->open_) return;
    if (error) return self->lost(error.message());
    self->unsent_.pop_front();
    if (!self->unsent_.empty()) self->write();
  };
  boost::asio::async_write(socket_, boost::asio::buffer(unsent_.front()), written);
}

void LineClient::read() {
  const auto come = [self = shared_from_this()](error_code error, std::size_t size) {
    if (!self->open_) return;
    if (error) return self->lost(error == boost::asio::error::eof ? "prismd closed the connection" : error.message());
    const std::string line = self->received_.substr(0, size);
    self->received_.erase(0, size);
    if (self->received_.capacity() > kKeptBytes && self->received_.size() < kKeptBytes) self->received_.shrink_to_fit();
    self->take(line);
    if (self->open_) self->read();
  };
  boost::asio::async_read_until(socket_, boost::asio::dynamic_buffer(received_, kLineMax), '\n', come);
}

void LineClient::take(std::string_view line) {
  const auto parsed = parse_json_line(line);
  if (!parsed || !parsed->is_object())
    return lost("sent \"" + shortened(line, 40) + "\", expected an object of JSON; is this prismd's socket?");
  const json& message = *parsed;
  const auto id = message.find("id");
  if (id == message.end()) {
    if (const Message told = notification_) told(message);
    return;
  }
  if (!id->is_number_integer()) return;
  const auto asked = asked_.find(id->get<int>());
  if (asked == asked_.end()) return;
  const Message answer = std::move(asked->second);
  asked_.erase(asked);
  answer(message);
}

void LineClient::lost(const std::string& why) {
  const Gone told = std::move(gone_);
  close();
  if (told) told(why);
}

}  // namespace prism::prismrelay
