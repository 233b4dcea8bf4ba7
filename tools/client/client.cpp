// SPDX-License-Identifier: MIT
#include "tools/client/client.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/write.hpp>
#include <charconv>
#include <exception>
#include <filesystem>
#include <optional>
#include <utility>
#include <variant>

#include "base/escape.hpp"
#include "base/json_member.hpp"
#include "base/time_scale.hpp"
#include "config/socket_path.hpp"

namespace prism::client {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using nlohmann::json;
using Protocol = asio::local::stream_protocol;

constexpr std::chrono::milliseconds kFirstPause{500}, kLongestPause{2000};
// A stopping service closes its clients before it exits; a connection in between would start it again. systemd kills it
// after 15 s (TimeoutStopSec).
constexpr std::chrono::seconds kStopTime{20};
constexpr std::size_t kMaxLineBytes = 32 << 20, kMaxRoom = 256 << 10, kMaxRequests = 256;

// Changes with each start of the systemd service of a socket. nullopt if systemd does not listen there or the service
// is not running. See config::would_start() for the files.
using ServiceRun = std::optional<std::pair<std::uint64_t, std::int64_t>>;

ServiceRun service_run(const std::string& socket) {
  const std::filesystem::path path = socket;
  struct stat found {};
  if (::lstat((path.parent_path() / "activated" / path.filename()).c_str(), &found) != 0) return std::nullopt;
  if (::stat((path.parent_path() / "running" / path.stem()).c_str(), &found) != 0) return std::nullopt;
  return std::pair<std::uint64_t, std::int64_t>(found.st_ino,
                                                found.st_ctim.tv_sec * 1'000'000'000 + found.st_ctim.tv_nsec);
}

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
bool parse_answer(const json& message, std::uint64_t& id, std::string& member) {
  const json& number = prism::member(message, "id");
  if (!number.is_number_unsigned()) return false;
  id = number.get<std::uint64_t>();
  const char* const key = message.contains("error") ? "error" : "result";
  member = fmt::format("\"{}\":{}", key, json_text(prism::member(message, key)));
  return true;
}

}  // namespace

Response response_of(std::string_view method, json message) {
  const auto failed = [](config::SocketError code, std::string why) {
    return Response(tl::unexpect, RequestError{code, {"prismd", std::move(why)}});
  };
  if (const json& error = member(message, "error"); !error.is_null()) {
    const json& code = member(error, "code");
    const int number = code.is_number_integer() ? code.get<int>() : config::kFailed;
    const json& page = member(error, "data");  // the deleted rows as `missing`
    if (number == config::kRowsGone && member(page, "axes").is_object()) return Response(page);
    return failed(static_cast<config::SocketError>(number), text_member(error, "message", "refused"));
  }
  json result = message.is_object() ? std::move(message["result"]) : json();
  const config::SocketMethod* const known = config::find_method(method);
  if (known != nullptr && known->of_axes && !member(result, "axes").is_object())
    return failed(config::kFailed, "found a response of protocol 1, expected 2: this prismd is older; restart it");
  return Response(std::move(result));
}

Response response_of_member(std::string_view method, std::string_view member) {
  return response_of(method, parse_json_line("{" + std::string(member) + "}").value_or(json()));
}

std::string error_member(int code, const std::string& message) {
  return R"("error":)" + json_text(json{{"code", code}, {"message", message}});
}

const json& of_axis(const json& result, const std::string& axis) {
  const json& axes = member(result, "axes");
  if (!axis.empty()) return member(axes, axis);
  static const json kNone;
  return axes.is_object() && axes.size() == 1 ? *axes.begin() : kNone;
}

json with_axis(json result, const std::string& axis) {
  const json own = of_axis(result, axis);
  result.erase("axes");
  result["axis"] = axis;
  if (!own.is_object()) return result;
  for (const auto& [key, value] : own.items()) {
    json& target = result[key];
    if (key == "log" && target.is_object() && value.is_object()) {
      target.update(value);
    } else {
      target = value;
    }
  }
  return result;
}

/// `answer` is empty until the response, or an error, is there; then `answered` is cancelled.
struct Client::Request {
  Request(asio::io_context& io, std::string method_name, std::string text)
      : method(std::move(method_name)), params(std::move(text)), answered(io) {}
  void finish(std::string member) {
    answer = std::move(member);
    answered.cancel();
  }

  std::string method, params, answer;
  asio::steady_timer answered;
};

Client::Client(asio::io_context& io, std::string socket, std::chrono::milliseconds timeout)
    : io_(io),
      path_(std::move(socket)),
      name_(config::instance_name(path_)),
      timeout_(timeout),
      socket_(io),
      pause_(io) {}

asio::awaitable<void> Client::run(Session session, bool may_start) {
  ServiceRun ended;  // the run of the service that closed the last connection
  Clock::time_point ended_at;
  auto pause = kFirstPause;
  while (!closed_) {
    const ServiceRun now = service_run(path_);
    const bool stopping = now && now == ended && Clock::now() < ended_at + kStopTime;
    if (config::would_start(path_) && !may_start) {
      state_ = State::kStopped;
      if (on_end) on_end(state_, "stopped");
    } else if (!stopping) {
      may_start = false;
      const std::string reason = co_await once(session);
      if (closed_) break;
      if (answered_) pause = kFirstPause;
      if (ended_by_prismd_) ended = now, ended_at = Clock::now();
      if (config::would_start(path_)) state_ = State::kStopped;
      if (on_end) on_end(state_, reason);
    }
    if (closed_) break;
    pause_.expires_after(scaled(pause));
    co_await pause_.async_wait(kUse);
    pause = std::min(2 * pause, kLongestPause);
  }
}

asio::awaitable<std::string> Client::once(Session session) {
  using namespace asio::experimental::awaitable_operators;
  state_ = State::kGone;
  answered_ = ended_by_prismd_ = false;
  end_reason_.clear();
  received_.clear();
  searched_ = 0;
  Protocol::endpoint endpoint;
  std::string reason;
  try {
    endpoint = path_;
  } catch (const boost::system::system_error& error) {  // the path is too long
    reason = error.code().message();
  }
  if (reason.empty()) {
    const auto [error] = co_await socket_.async_connect(endpoint, kUse);
    if (error) reason = error.message();
  }
  if (reason.empty()) {
    state_ = State::kConnected;
    const auto ended = co_await (read() || session());
    reason = !end_reason_.empty() ? end_reason_ : std::visit([](const std::string& text) { return text; }, ended);
  } else {
    reason = "no prismd answers: " + reason;
  }
  state_ = State::kGone;
  error_code ignored;
  socket_.close(ignored);
  fail_requests();
  co_return reason;
}

void Client::end(const std::string& reason) {
  end_reason_ = reason;
  error_code ignored;
  socket_.close(ignored);
}

void Client::close() {
  closed_ = true;
  end("closed");
  pause_.cancel();
}

asio::awaitable<std::string> Client::ask_text(std::string method, std::string params) {
  if (state_ != State::kConnected) co_return error_member(config::kGone, name_ + " is not running");
  if (requests_.size() >= kMaxRequests)
    co_return error_member(config::kBusy, "too many requests pending for " + name_ + "; retry later");
  const auto request = std::make_shared<Request>(io_, std::move(method), std::move(params));
  request->answered.expires_after(timeout_);
  requests_.push_back(request);
  send_next();
  co_await request->answered.async_wait(kUse);
  if (request->answer.empty()) drop(request);  // else the client may not exist
  co_return std::move(request->answer);
}

asio::awaitable<Response> Client::ask(std::string method, json params) {
  std::string text = params.is_null() ? "{}" : json_text(params);
  const std::string member = co_await ask_text(method, std::move(text));
  co_return response_of_member(method, member);
}

// After the timeout, or if the asking coroutine was cancelled. A sent request remains: the next one is sent after its
// response.
void Client::drop(const std::shared_ptr<Request>& request) {
  request->answer = error_member(config::kTimeout, fmt::format("{} did not respond within {} s", name_,
                                                               std::chrono::duration<double>(timeout_).count()));
  if (sent_id_ != 0 && Clock::now() - sent_at_ >= timeout_)
    end("prismd did not respond to " + requests_.front()->method);
  if (sent_id_ == 0 || request != requests_.front()) std::erase(requests_, request);
}

void Client::fail_requests() {
  sent_id_ = 0;
  for (const auto& request : std::exchange(requests_, {}))
    request->finish(error_member(config::kGone, name_ + " disconnected"));
}

void Client::send_next() {
  if (sent_id_ != 0 || requests_.empty()) return;
  sent_id_ = ++last_id_;
  sent_at_ = Clock::now();
  const auto line = std::make_shared<std::string>(
      fmt::format(R"({{"jsonrpc":"2.0","id":{},"method":"{}","params":{},"protocol":{}}})"
                  "\n",
                  sent_id_, requests_.front()->method, requests_.front()->params, config::kProtocol));
  asio::async_write(socket_, asio::buffer(*line), [line](error_code, std::size_t) {});  // read() notices an error
}

// Returns the reason of the end.
asio::awaitable<std::string> Client::read() {
  for (;;) {
    const std::size_t before = received_.size();
    received_.resize(before + room_);
    const auto buffer = asio::buffer(received_.data() + before, room_);
    const auto [error, size] = co_await socket_.async_read_some(buffer, kUse);
    received_.resize(before + size);
    ended_by_prismd_ = error && end_reason_.empty();
    if (error == asio::error::eof || error == asio::error::connection_reset) co_return "prismd closed the connection";
    if (error) co_return error.message();
    std::string reason = take_lines();
    if (reason.empty() && received_.size() > kMaxLineBytes)
      reason = "sent a line that is too long; is this prismd's socket?";
    if (!reason.empty()) co_return reason;
    adapt_room(size);
  }
}

// Returns the reason to end; empty: continue.
std::string Client::take_lines() {
  std::size_t begin = 0;
  for (std::size_t end; (end = received_.find('\n', std::max(begin, searched_))) != std::string::npos;
       begin = end + 1) {
    std::string reason = take_line(std::string_view(received_).substr(begin, end - begin));
    if (!reason.empty() || !end_reason_.empty()) return reason + end_reason_;
  }
  received_.erase(0, begin);
  searched_ = received_.size();
  return {};
}

// There may be 1000 connections, most of them idle.
void Client::adapt_room(std::size_t read_bytes) {
  if (read_bytes == room_) {
    room_ = std::min(4 * room_, kMaxRoom);
  } else if (read_bytes < room_ / 8 && room_ > kMinRoom) {
    room_ = kMinRoom;
    if (received_.size() < kMinRoom) received_.shrink_to_fit();
  }
}

std::string Client::take_line(std::string_view line) {
  constexpr std::string_view kNotification = R"({"jsonrpc":"2.0","method":)";
  std::uint64_t id = 0;
  std::string_view member;
  std::string text;
  bool is_answer = split_answer(line, id, member);
  if (!is_answer && !line.starts_with(kNotification)) {
    const auto message = parse_json_line(line);
    if (!message || !message->is_object())
      return "sent \"" + shortened(line, 40) + "\", expected a JSON object; is this prismd's socket?";
    const json& error = prism::member(*message, "error");  // without an id: the connection is rejected
    if (!error.is_null() && prism::member(*message, "id").is_null())
      return text_member(error, "message", "prismd rejected the connection");
    is_answer = parse_answer(*message, id, text);
    member = text;
  }
  if (!is_answer) {
    if (on_notification) on_notification(line);
  } else if (id == sent_id_ && id != 0) {
    answered_ = true;
    sent_id_ = 0;
    const auto request = requests_.front();
    requests_.pop_front();
    if (request->answer.empty()) request->finish(std::string(member));
    send_next();
  }
  return {};
}

Result<void> connected(const std::string& socket, const Work& work) {
  asio::io_context io;
  Client client(io, socket);
  std::optional<Result<void>> result;
  std::string reason;
  const Client::Session session = [&]() -> asio::awaitable<std::string> {
    result = co_await work(client);
    co_return "";
  };
  asio::co_spawn(io, client.once(session), [&](const std::exception_ptr& thrown, std::string ended) {
    if (thrown) std::rethrow_exception(thrown);
    reason = std::move(ended);
  });
  io.run();
  if (!reason.empty()) return make_error(socket, reason);
  return *result;
}

}  // namespace prism::client
