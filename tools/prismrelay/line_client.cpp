// SPDX-License-Identifier: MIT
#include "tools/prismrelay/line_client.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <utility>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "config/socket_protocol.hpp"

namespace prism::prismrelay {

using boost::system::error_code;
using nlohmann::json;

void LineClient::open(const std::string& path, OnMessage on_notification, OnDisconnect on_disconnect) {
  on_notification_ = std::move(on_notification);
  on_disconnect_ = std::move(on_disconnect);
  open_ = true;
  const auto on_connected = [self = shared_from_this()](error_code error) {
    if (!self->open_) return;
    if (error) return self->disconnect(error.message());
    self->connected_ = true;
    self->read();
    if (!self->unsent_.empty()) self->write();
  };
  boost::asio::local::stream_protocol::endpoint endpoint;
  try {
    endpoint = path;
  } catch (const boost::system::system_error& error) {  // the path is too long
    boost::asio::post(socket_.get_executor(),
                      [self = shared_from_this(), reason = error.code().message()] { self->disconnect(reason); });
    return;
  }
  socket_.async_connect(endpoint, on_connected);
}

void LineClient::call(const char* method, const json& params, OnMessage on_response) {
  json request = {{"jsonrpc", "2.0"}, {"id", ++last_id_}, {"method", method}, {"protocol", config::kProtocol}};
  if (!params.is_null()) request["params"] = params;
  pending_[last_id_] = std::move(on_response);
  unsent_.push_back(json_text(request) + "\n");
  if (connected_ && unsent_.size() == 1) write();
}

void LineClient::close() {
  open_ = connected_ = false;
  on_notification_ = nullptr;
  on_disconnect_ = nullptr;
  pending_.clear();
  error_code ignored;
  socket_.close(ignored);
}

void LineClient::write() {
  const auto on_written = [self = shared_from_this()](error_code error, std::size_t) {
    if (!self->open_) return;
    if (error) return self->disconnect(error.message());
    self->unsent_.pop_front();
    if (!self->unsent_.empty()) self->write();
  };
  boost::asio::async_write(socket_, boost::asio::buffer(unsent_.front()), on_written);
}

void LineClient::read() {
  const auto on_read = [self = shared_from_this()](error_code error, std::size_t size) {
    if (!self->open_) return;
    if (error)
      return self->disconnect(error == boost::asio::error::eof ? "prismd closed the connection" : error.message());
    const std::string line = self->received_.substr(0, size);
    self->received_.erase(0, size);
    if (self->received_.capacity() > kIdleBufferBytes && self->received_.size() < kIdleBufferBytes)
      self->received_.shrink_to_fit();
    self->on_line(line);
    if (self->open_) self->read();
  };
  boost::asio::async_read_until(socket_, boost::asio::dynamic_buffer(received_, kMaxLineBytes), '\n', on_read);
}

void LineClient::on_line(std::string_view line) {
  const auto parsed = parse_json_line(line);
  if (!parsed || !parsed->is_object())
    return disconnect("sent \"" + shortened(line, 40) + "\", expected a JSON object; is this prismd's socket?");
  const json& message = *parsed;
  const auto id = message.find("id");
  if (id == message.end()) {
    if (const OnMessage callback = on_notification_) callback(message);  // a copy: the callback may close()
    return;
  }
  if (!id->is_number_integer()) return;
  const auto request = pending_.find(id->get<int>());
  if (request == pending_.end()) return;
  const OnMessage on_response = std::move(request->second);
  pending_.erase(request);
  on_response(message);
}

void LineClient::disconnect(const std::string& reason) {
  const OnDisconnect callback = std::move(on_disconnect_);
  close();
  if (callback) callback(reason);
}

}  // namespace prism::prismrelay
