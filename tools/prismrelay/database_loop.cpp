// SPDX-License-Identifier: MIT
#include "tools/prismrelay/database_loop.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

#include "base/json_member.hpp"
#include "tools/prismrelay/instances.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono::steady_clock;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;
using std::chrono_literals::operator""h;

constexpr const char* kServer = "postgresql";
constexpr std::size_t kLargeBatch = 4 << 20;  // bytes: committed at once
constexpr auto kFirstRetry = 500ms, kLongestRetry = 30'000ms;
constexpr auto kIdle = 5s;       // after that the server is asked whether it is there
constexpr auto kDaysEvery = 1h;  // partitions ahead, and retention
constexpr int kEvents = 256;     // that a prismd keeps

}  // namespace

DatabaseLoop::DatabaseLoop(const Settings& settings, RelayState& state)
    : settings_(settings),
      state_(state),
      context_(1),
      commit_timer_(context_),
      retry_timer_(context_),
      second_timer_(context_),
      database_(*settings.postgresql, settings.site, [&state] { state.progress(kLoop); }),
      pause_(kFirstRetry) {
  traffic_.batch = &batch_;
  traffic_.state = &state_;
  traffic_.follower = settings.postgresql->follower;
  traffic_.gathered = [this] { gathered(); };
  traffic_.freed = [this] {
    if (std::exchange(asking_, true)) return;
    boost::asio::post(context_, [this] {
      asking_ = false;
      each_log([](LogTailer& log) { log.ask(); });
    });
  };
}

void DatabaseLoop::run() {
  connect();
  once_a_second();
  context_.run();
}

void DatabaseLoop::stop() {
  boost::asio::post(context_, [this] {
    if (traffic_.open && !batch_.empty()) commit();
    for (auto& [gyro, source] : sources_) source.instance->close();
    context_.stop();
  });
}

template <class Do>
void DatabaseLoop::each_log(Do&& act) {
  for (auto& [gyro, source] : sources_) {
    for (const auto& log : source.logs) act(*log);
  }
}

void DatabaseLoop::connect() {
  if (const auto done = database_.connect(); !done) return failed(done.error());
  state_.up(kServer);
  pause_ = kFirstRetry;
  last_talk_ = steady_clock::now();
  traffic_.open = true;
  keep_days();
  if (!traffic_.open) return;
  each_log([this](LogTailer& log) { log.resume(database_.place(log.log())); });
  for (auto& [gyro, source] : sources_) {
    if (!source.instance->running()) continue;
    source.instance->ask("events", {{"count", kEvents}},
                         [this, name = gyro](const json& message) { take_events(name, message); });
  }
}

// Nothing that was gathered counts: where to go on, the ledger says when it is there again.
void DatabaseLoop::failed(const Error& error) {
  state_.down(kServer, error.text());
  traffic_.open = false;
  batch_ = {};
  commit_timer_.cancel();
  waiting_ = false;
  each_log([](LogTailer& log) { log.dropped(); });
  retry_timer_.expires_after(pause_);
  pause_ = std::min(pause_ * 2, std::chrono::milliseconds(kLongestRetry));
  retry_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) connect();
  });
}

// The ones that prismd still has: those of before, too.
void DatabaseLoop::take_events(const std::string& gyro, const json& message) {
  const auto events = message.find("result");
  if (!traffic_.open || events == message.end() || !events->is_array()) return;
  for (const json& event : *events) batch_.add_event(gyro, event);
  gathered();
}

void DatabaseLoop::gathered() {
  if (batch_.bytes() >= kLargeBatch) return commit();
  if (batch_.empty() || std::exchange(waiting_, true)) return;
  commit_timer_.expires_after(std::chrono::milliseconds(static_cast<int>(settings_.postgresql->gather_s * 1000)));
  commit_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) commit();
  });
}

void DatabaseLoop::commit() {
  waiting_ = false;
  commit_timer_.cancel();
  if (batch_.empty() || !traffic_.open) return;
  if (const auto done = database_.commit(batch_); !done) return failed(done.error());
  batch_ = {};
  state_.committed(kServer);
  last_talk_ = steady_clock::now();
  each_log([](LogTailer& log) { log.committed(); });
}

void DatabaseLoop::keep_days() {
  days_kept_ = steady_clock::now();
  const auto dropped = database_.keep_days();
  if (!dropped) return failed(dropped.error());
  for (const std::string& line : *dropped) say(Level::kWarning, line);
}

void DatabaseLoop::discover() {
  const auto found = find_instances(settings_.instances, state_);
  for (const auto& [name, socket] : found) {
    const std::string gyro = settings_.site + "/" + name;
    if (sources_.count(gyro) == 0) follow(gyro, socket);
  }
  for (auto at = sources_.begin(); at != sources_.end();) {
    const std::string name = at->first.substr(settings_.site.size() + 1);
    if (found.count(name) != 0 || at->second.instance->running()) {
      ++at;
      continue;
    }
    at->second.instance->close();
    for (const auto& log : at->second.logs) log->close();
    state_.forget(at->first);
    at = sources_.erase(at);
  }
}

void DatabaseLoop::follow(const std::string& gyro, const std::string& socket) {
  Source& source = sources_[gyro];
  InstanceClient::Calls calls;
  calls.begun = [this, &source](const json& status) { begun(source, status); };
  calls.told = [this, gyro](const json& told) {
    if (member(told, "method") != "event" || !traffic_.open) return;
    batch_.add_event(gyro, member(told, "params"));
    gathered();
  };
  calls.gone = [&source] {
    for (const auto& log : source.logs) log->close();
  };
  source.instance = std::make_shared<InstanceClient>(context_, state_, gyro, socket, std::move(calls));
  source.instance->begin();
}

// A row that is still on its way to the ledger belongs to a follower of before: it is let go when the commit came.
void DatabaseLoop::begun(Source& source, const json& status) {
  if (traffic_.open && !batch_.empty()) commit();
  for (const auto& log : source.logs) log->close();
  source.logs.clear();
  const std::string& gyro = source.instance->gyro();
  const StatusAxes axes = axes_of(status);
  for (const std::string& name : axes.invalid) state_.skipped_axis(gyro, name);
  for (const std::string& axis : axes.names) {
    auto log = std::make_shared<LogTailer>(context_, traffic_, LogKey{gyro, axis}, axes.several ? axis : "");
    const std::weak_ptr<InstanceClient> instance = source.instance;
    log->open(source.instance->socket(), [instance](const std::string& why) {
      if (const auto whole = instance.lock(); whole && whole->running()) whole->restart(why);
    });
    source.logs.push_back(log);
  }
  const auto keep = [this, gyro](const json& message) { take_events(gyro, message); };
  source.instance->ask("subscribe", {{"streams", {"event"}}}, [](const json&) {});
  source.instance->ask("events", {{"count", kEvents}}, keep);
  if (!traffic_.open) return;
  for (const auto& log : source.logs) log->resume(database_.place(log->log()));
}

void DatabaseLoop::once_a_second() {
  state_.progress(kLoop);
  discover();
  const auto now = steady_clock::now();
  for (auto& [gyro, source] : sources_) {
    const auto is_unresponsive = [&](const auto& log) { return log->is_unresponsive(now); };
    if (std::any_of(source.logs.begin(), source.logs.end(), is_unresponsive))
      source.instance->restart("does not answer");
  }
  each_log([](LogTailer& log) { log.ask(); });
  if (traffic_.open && now - last_talk_ > kIdle) {
    last_talk_ = now;
    if (const auto there = database_.ping(); !there) failed(there.error());
  }
  if (traffic_.open && now - days_kept_ > kDaysEvery) keep_days();
  second_timer_.expires_after(1s);
  second_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) once_a_second();
  });
}

}  // namespace prism::prismrelay
