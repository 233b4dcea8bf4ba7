// SPDX-License-Identifier: MIT
#include "tools/prismweb/hub.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/write.hpp>
#include <charconv>
#include <utility>

#include "config/socket_place.hpp"
#include "tools/prismweb/awaiting.hpp"
#include "tools/prismweb/json_text.hpp"
#include "tools/prismweb/run_mark.hpp"

namespace prism::prismweb {
namespace {

namespace asio = boost::asio;
using nlohmann::json;

constexpr std::chrono::milliseconds kRetry{500};
constexpr std::chrono::seconds kPatience{15};
// A service that is told to end closes its clients before it ends: a connection in between would start it again.
// systemd gives it 15 s (TimeoutStopSec).
constexpr std::chrono::seconds kEnding{20};
constexpr std::size_t kMostLineBytes = 32 << 20;
// prismd answers a request of more than 2000 values without its id, and closes the connection, which is everybody's,
// where a line is longer than 65 536 bytes. So many bytes hold neither.
constexpr std::size_t kMostParamsBytes = 2000;

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

std::string error_member(int code, const std::string& message) {
  return R"("error":)" + dumped({{"code", code}, {"message", message}});
}

Hub::Hub(asio::io_context& io, std::string name, std::string socket)
    : io_(io), name_(std::move(name)), path_(std::move(socket)), socket_(io), topics_(name_) {}

json Hub::listing() const {
  const char* const state = state_ == HubState::kRunning   ? "running"
                            : state_ == HubState::kStopped ? "stopped"
                                                           : "gone";
  return {{"name", name_}, {"state", state}, {"axes", axes_}};
}

asio::awaitable<void> Hub::run() {
  asio::co_spawn(io_, expire(), asio::detached);
  asio::steady_timer pause(io_);
  const Protocol::endpoint there(path_);
  RunMark ended;  // the run of a service that closed this connection
  auto ended_at = Clock::now();
  for (;;) {
    const RunMark now = run_mark(path_);
    const bool ending = ended && now == ended && Clock::now() < ended_at + kEnding;
    if (config::would_start(path_)) {
      become(HubState::kStopped);
    } else if (!ending) {
      socket_ = Protocol::socket(io_);
      const auto [error] = co_await socket_.async_connect(there, kUse);
      if (!error) {
        co_await session();
        disconnected();
        ended = now;
        ended_at = Clock::now();
      }
      become(HubState::kGone);
    }
    pause.expires_after(kRetry);
    co_await pause.async_wait(kUse);
  }
}

asio::awaitable<void> Hub::session() {
  learn_axes();
  std::string pending;
  std::vector<char> buffer(256 << 10);
  const auto room = asio::buffer(buffer);
  for (std::size_t searched = 0;;) {
    const auto [error, size] = co_await socket_.async_read_some(room, kUse);
    if (error) break;
    pending.append(buffer.data(), size);
    std::size_t begin = 0;
    for (std::size_t end; (end = pending.find('\n', std::max(begin, searched))) != std::string::npos; begin = end + 1)
      read_line(std::string_view(pending).substr(begin, end - begin));
    pending.erase(0, begin);
    searched = pending.size();
    if (pending.size() > kMostLineBytes) break;
  }
}

// What prismd serves is known when it has said so; until then nobody is told that it runs.
void Hub::learn_axes() {
  send("status", "{}", [this](std::string_view member) {
    const json answer = json::parse("{" + std::string(member) + "}", nullptr, false);
    if (!answer.is_object() || !answer.contains("result") || !answer["result"].is_object()) return socket_.close();
    const json& status = answer["result"];
    axes_.clear();
    if (status.contains("axes") && status["axes"].is_object()) {
      for (const auto& [axis, of_axis] : status["axes"].items()) axes_.push_back(axis);
    } else if (status.contains("axis") && status["axis"].is_string()) {
      axes_.push_back(status["axis"]);
    }
    state_ = HubState::kRunning;
    subscribed_every_ = 0;
    send("subscribe", R"({"streams":["window","event"]})", [](std::string_view) {});
    subscribe();
    if (on_change) on_change();
    if (on_connect) on_connect();
  });
}

void Hub::subscribe() {
  const std::uint32_t every = topics_.sample_every();
  if (state_ != HubState::kRunning || every == subscribed_every_) return;
  subscribed_every_ = every;
  send(every > 0 ? "subscribe" : "unsubscribe",
       every > 0 ? fmt::format(R"({{"streams":["sample"],"every":{}}})", every) : R"({"streams":["sample"]})",
       [](std::string_view) {});
}

void Hub::wish(Subscriber* who, const Wish& wish) {
  topics_.set(who, wish);
  subscribe();
}

void Hub::ask(std::string_view method, const nlohmann::json& params, Answer answer) {
  if (state_ != HubState::kRunning) return answer(error_member(kNotRunning, name_ + " does not run"));
  std::string text = params.is_null() ? "{}" : dumped(params);
  if (text.size() > kMostParamsBytes)
    return answer(error_member(
        kWrongParams, fmt::format("found params of {} bytes, expected at most {}", text.size(), kMostParamsBytes)));
  if (method != "rows") return send(method, text, std::move(answer));
  rows_.push_back({std::move(text), std::move(answer)});
  next_rows();
}

void Hub::next_rows() {
  if (rows_under_way_ || rows_.empty()) return;
  Queued next = std::move(rows_.front());
  rows_.pop_front();
  rows_under_way_ = true;
  send("rows", next.params, std::move(next.answer));
}

void Hub::send(std::string_view method, const std::string& params, Answer answer) {
  const std::uint64_t id = ++last_id_;
  waiting_.emplace(id, Waiting{std::move(answer), Clock::now() + kPatience, method == "rows"});
  send_line(fmt::format(R"({{"jsonrpc":"2.0","id":{},"method":"{}","params":{}}})"
                        "\n",
                        id, method, params));
}

void Hub::send_line(std::string line) {
  outgoing_.push_back(std::move(line));
  if (!writing_) write_next();
}

void Hub::write_next() {
  if (outgoing_.empty()) return;
  writing_ = true;
  asio::async_write(socket_, asio::buffer(outgoing_.front()),
                    [this](const boost::system::error_code& error, std::size_t) {
                      writing_ = false;
                      if (error || outgoing_.empty()) return;  // the reader sees the end, too
                      outgoing_.pop_front();
                      write_next();
                    });
}

void Hub::read_line(std::string_view line) {
  std::uint64_t id = 0;
  std::string_view member;
  if (const Notification notification = notification_of(line); !notification.method.empty()) {
    if (on_notification) on_notification(notification);
    topics_.put(notification);
  } else if (split_answer(line, id, member)) {
    const auto waiting = waiting_.find(id);
    if (waiting == waiting_.end()) return;  // it came too late
    const Waiting own = std::move(waiting->second);
    waiting_.erase(waiting);
    if (own.rows) rows_under_way_ = false;
    own.answer(member);
    next_rows();
  }
}

asio::awaitable<void> Hub::expire() {
  asio::steady_timer tick(io_);
  for (;;) {
    tick.expires_after(std::chrono::seconds(1));
    co_await tick.async_wait(kUse);
    const auto now = Clock::now();
    std::vector<Waiting> late;
    for (auto at = waiting_.begin(); at != waiting_.end();) {
      const bool is_late = at->second.until < now;
      if (is_late) late.push_back(std::move(at->second));
      at = is_late ? waiting_.erase(at) : std::next(at);
    }
    const std::string member =
        error_member(kNotRunning, fmt::format("{} did not answer within {} s", name_, kPatience.count()));
    for (const Waiting& one : late) {
      if (one.rows) rows_under_way_ = false;
      one.answer(member);
    }
    next_rows();
  }
}

void Hub::disconnected() {
  boost::system::error_code ignored;
  socket_.close(ignored);
  outgoing_.clear();
  become(HubState::kGone);
  const std::string member = error_member(kNotRunning, name_ + " went away");
  const auto waiting = std::exchange(waiting_, {});
  const auto rows = std::exchange(rows_, {});
  rows_under_way_ = false;
  for (const auto& [id, one] : waiting) one.answer(member);
  for (const Queued& one : rows) one.answer(member);
}

void Hub::become(HubState state) {
  if (std::exchange(state_, state) != state && on_change) on_change();
}

}  // namespace prism::prismweb
