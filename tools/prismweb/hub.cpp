// SPDX-License-Identifier: MIT
#include "tools/prismweb/hub.hpp"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
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
// A service that is told to end closes its clients before it ends: a connection in between would start it again.
// systemd gives it 15 s (TimeoutStopSec).
constexpr std::chrono::seconds kEnding{20};
// prismd answers a request of more than 2000 values without its id, and closes the connection, which is everybody's,
// where a line is longer than 65 536 bytes. So many bytes hold neither.
constexpr std::size_t kMostParamsBytes = 2000;

bool is_long(std::string_view method) { return method == "rows" || method == "history" || method == "events"; }

}  // namespace

std::string error_member(int code, const std::string& message) {
  return R"("error":)" + json_text({{"code", code}, {"message", message}});
}

Hub::Hub(asio::io_context& io, std::string name, std::string socket)
    : io_(io),
      name_(std::move(name)),
      path_(std::move(socket)),
      short_(io, path_),
      long_(io, path_),
      ears_(io, path_),
      topics_(name_) {}

json Hub::listing() const {
  const char* const state = state_ == HubState::kRunning   ? "running"
                            : state_ == HubState::kStopped ? "stopped"
                                                           : "gone";
  return {{"name", name_}, {"state", state}, {"axes", axes_}};
}

asio::awaitable<void> Hub::run() {
  asio::co_spawn(io_, expire(), asio::detached);
  asio::steady_timer pause(io_);
  RunMark ended;  // the run of a service that closed this connection
  auto ended_at = std::chrono::steady_clock::now();
  for (;;) {
    const RunMark now = run_mark(path_);
    const bool ending = ended && now == ended && std::chrono::steady_clock::now() < ended_at + kEnding;
    if (config::would_start(path_)) {
      become(HubState::kStopped);
    } else if (!ending) {
      const bool connected = co_await connect();
      if (connected) {
        co_await session();
        disconnected();
        ended = now;
        ended_at = std::chrono::steady_clock::now();
      }
      become(HubState::kGone);
    }
    pause.expires_after(kRetry);
    co_await pause.async_wait(kUse);
  }
}

asio::awaitable<bool> Hub::connect() {
  for (Lane* const lane : lanes_) {
    const bool stopped = config::would_start(path_);  // since the last one
    bool there = false;
    if (!stopped) there = co_await lane->connect();
    if (there) continue;
    for (Lane* const one : lanes_) one->close();
    co_return false;
  }
  co_return true;
}

// Where one of them ends, all do.
asio::awaitable<void> Hub::session() {
  using namespace asio::experimental::awaitable_operators;
  short_.ask("status", "{}", [this](std::string_view member) { learn(member); });
  const Lane::Other hear_line = [this](std::string_view line) { hear(line); };
  auto reading = ears_.read(hear_line) || short_.read(hear_line) || long_.read(hear_line);
  co_await std::move(reading);
}

void Hub::hear(std::string_view line) {
  const Notification notification = notification_of(line);
  if (notification.method.empty()) return;
  if (on_notification) on_notification(notification);
  topics_.put(notification);
}

// What prismd serves is known when it has said so; until then nobody is told that it runs.
void Hub::learn(std::string_view member) {
  const json answer = json::parse("{" + std::string(member) + "}", nullptr, false);
  if (!answer.is_object() || !answer.contains("result") || !answer["result"].is_object()) return short_.close();
  const json& status = answer["result"];
  axes_.clear();
  if (status.contains("axes") && status["axes"].is_object()) {
    for (const auto& [axis, of_axis] : status["axes"].items()) axes_.push_back(axis);
  } else if (status.contains("axis") && status["axis"].is_string()) {
    axes_.push_back(status["axis"]);
  }
  listen();
}

// Before anything is asked of the past, so that no second falls in between.
void Hub::listen() {
  ears_.ask("subscribe", R"({"streams":["window","event"]})", [this](std::string_view member) {
    if (!member.starts_with(R"("result")")) return ears_.close();
    state_ = HubState::kRunning;
    subscribed_every_ = 0;
    subscribing_ = false;
    subscribe();
    if (on_change) on_change();
    if (on_connect) on_connect();
  });
}

// One change after the other, whatever clients wish in between.
void Hub::subscribe() {
  const std::uint32_t every = topics_.sample_every();
  if (state_ != HubState::kRunning || subscribing_ || every == subscribed_every_) return;
  subscribing_ = true;
  subscribed_every_ = every;
  ears_.ask(every > 0 ? "subscribe" : "unsubscribe",
            every > 0 ? fmt::format(R"({{"streams":["sample"],"every":{}}})", every) : R"({"streams":["sample"]})",
            [this](std::string_view) {
              subscribing_ = false;
              subscribe();
            });
}

void Hub::wish(Subscriber* who, const Wish& wish) {
  topics_.set(who, wish);
  subscribe();
}

void Hub::ask(std::string_view method, const nlohmann::json& params, Answer answer) {
  if (state_ != HubState::kRunning) return answer(error_member(kNotRunning, name_ + " does not run"));
  const std::string text = params.is_null() ? "{}" : json_text(params);
  if (text.size() > kMostParamsBytes)
    return answer(error_member(
        kWrongParams, fmt::format("found params of {} bytes, expected at most {}", text.size(), kMostParamsBytes)));
  if (!(is_long(method) ? long_ : short_).ask(method, text, answer))
    answer(error_member(kTooMuch, "so many questions wait for " + name_ + " that this one is not taken"));
}

asio::awaitable<void> Hub::expire() {
  asio::steady_timer tick(io_);
  const std::string member =
      error_member(kNotRunning, fmt::format("{} did not answer within {} s", name_, kAnswerPatience.count()));
  for (;;) {
    tick.expires_after(std::chrono::seconds(1));
    co_await tick.async_wait(kUse);
    for (Lane* const lane : lanes_) lane->expire(member);
  }
}

void Hub::disconnected() {
  become(HubState::kGone);
  const std::string member = error_member(kNotRunning, name_ + " went away");
  for (Lane* const lane : lanes_) lane->end(member);
}

void Hub::become(HubState state) {
  if (std::exchange(state_, state) != state && on_change) on_change();
}

}  // namespace prism::prismweb
