// SPDX-License-Identifier: MIT
#include "tools/prismweb/ws_session.hpp"

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/connection.hpp"
#include "tools/prismweb/send_queue.hpp"
#include "tools/prismweb/web_server.hpp"
#include "tools/prismweb/ws_client.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;

constexpr std::size_t kMaxMessageBytes = 64 << 10;
constexpr std::chrono::seconds kFirstMessage{10}, kSilence{30}, kWriteTimeout{30};
constexpr std::chrono::seconds kPausedSilence{600};  // a client that is not read cannot answer pings

class WsSession final : public Channel, public std::enable_shared_from_this<WsSession> {
 public:
  WsSession(Stream stream, WebServer& server, bool is_authenticated, std::shared_ptr<Connection> connection)
      : connection_(std::move(connection)),
        ws_(std::move(stream)),
        watch_(server.io()),
        resume_(server.io(), asio::steady_timer::time_point::max()),
        client_(std::make_shared<WsClient>(server, *this, is_authenticated)),
        queue_(
            server.unsent_memory(), [this] { drop(); },
            [this](const std::string& instance, std::uint64_t rows, std::uint64_t rows_total) {
              return client_->lost_text(instance, rows, rows_total);
            }) {}

  asio::awaitable<void> run(const UpgradeRequest& request) {
    beast::get_lowest_layer(ws_).expires_never();
    set_silence(kSilence);
    ws_.read_message_max(kMaxMessageBytes);
    ws_.auto_fragment(false);
    ws_.text(true);
    const auto [error] = co_await ws_.async_accept(request, kUse);
    if (error) co_return;
    watch(kFirstMessage);
    co_await read();
    watch_.cancel();
    client_.reset();
    ended_ = true;
  }

  void answer(const Text& text) override {
    if (!queue_.answer(text)) return drop();
    write_next();
  }

  void batch(const std::string& instance, const Text& text, std::uint64_t rows) override {
    queue_.batch(instance, text, rows);
    write_next();
  }

 private:
  asio::awaitable<void> read() {
    beast::flat_buffer buffer(kMaxMessageBytes);
    for (;;) {
      const auto [error, size] = co_await ws_.async_read(buffer, kUse);
      if (error) co_return;
      const auto data = buffer.cdata();
      const auto reason = client_->message({static_cast<const char*>(data.data()), data.size()}, ws_.got_text());
      buffer.consume(size);
      if (reason) co_return co_await close_and_wait(*reason);
      connection_->is_known = client_->is_admitted();
      if (queue_.is_paused()) co_await wait_until_read();
    }
  }

  // Requests of a client that does not read its responses stay in the kernel.
  asio::awaitable<void> wait_until_read() {
    set_silence(kPausedSilence);
    while (queue_.is_paused() && !dropped_) co_await resume_.async_wait(kUse);
    set_silence(kSilence);
  }

  void set_silence(std::chrono::seconds silence) {
    ws_.set_option(websocket::stream_base::timeout{kFirstMessage, silence, true});
  }

  asio::awaitable<void> close_and_wait(const CloseReason& why) {
    const websocket::close_reason reason(static_cast<websocket::close_code>(why.code), why.reason);
    co_await ws_.async_close(reason, kUse);
  }

  void write_next() {
    if (writing_ || ended_ || dropped_ || queue_.empty()) return;
    writing_ = true;
    writing_since_ = std::chrono::steady_clock::now();
    text_ = queue_.take();
    ws_.async_write(asio::buffer(*text_),
                    [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                      self->writing_ = false;
                      self->text_.reset();
                      if (self->ended_) return;
                      self->queue_.sent();
                      if (error) return self->drop();
                      if (!self->queue_.is_paused()) self->resume_.cancel();
                      self->write_next();
                    });
  }

  // Disconnects a client that is not admitted in time or does not read.
  void watch(std::chrono::seconds timeout) {
    watch_.expires_after(timeout);
    watch_.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
      if (error) return;
      const bool is_stalled =
          self->writing_ && std::chrono::steady_clock::now() - self->writing_since_ >= kWriteTimeout;
      if (is_stalled) return self->drop();
      if (self->client_ && !self->client_->is_admitted()) return self->close("no token received in 10 s");
      self->watch(std::chrono::seconds(5));
    });
  }

  // Also ends read().
  void close(std::string_view why) {
    const websocket::close_reason reason(websocket::close_code::policy_error, why);
    ws_.async_close(reason, [self = shared_from_this()](const boost::system::error_code&) {});
  }

  // read() then fails and ends the session.
  void drop() {
    dropped_ = true;
    resume_.cancel();
    connection_->fd = -1;
    beast::get_lowest_layer(ws_).close();
  }

  std::shared_ptr<Connection> connection_;
  websocket::stream<Stream> ws_;
  asio::steady_timer watch_, resume_;
  std::shared_ptr<Client> client_;
  SendQueue queue_;
  Text text_;
  bool writing_ = false, ended_ = false, dropped_ = false;
  std::chrono::steady_clock::time_point writing_since_;
};

}  // namespace

asio::awaitable<void> run_websocket(Stream stream, const UpgradeRequest& request, WebServer& server,
                                    bool is_authenticated, std::shared_ptr<Connection> connection) {
  const auto session = std::make_shared<WsSession>(std::move(stream), server, is_authenticated, connection);
  co_await session->run(request);
}

}  // namespace prism::prismweb
