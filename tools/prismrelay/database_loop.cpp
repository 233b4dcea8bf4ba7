// SPDX-License-Identifier: MIT
#include "tools/prismrelay/database_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/json_member.hpp"
#include "base/time_scale.hpp"
#include "tools/prismrelay/instances.hpp"

namespace prism::prismrelay {
namespace {

using nlohmann::json;
using std::chrono::steady_clock;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;
using std::chrono_literals::operator""h;

constexpr const char* kServer = "postgresql";
constexpr std::size_t kLargeBatch = 4 << 20;  // bytes; committed immediately
constexpr auto kFirstRetry = 500ms, kLongestRetry = 60'000ms;
constexpr auto kIdle = 5s;             // then the connection is checked
constexpr auto kPartitionsEvery = 1h;  // creates partitions in advance and drops old ones
constexpr auto kRetentionEvery = 60s;  // while the database is down
constexpr int kEvents = 256;           // a prismd stores at most these

}  // namespace

DatabaseLoop::DatabaseLoop(const Settings& settings, RelayState& state)
    : settings_(settings),
      state_(state),
      context_(1),
      commit_timer_(context_),
      retry_timer_(context_),
      second_timer_(context_),
      database_(*settings.postgresql, settings.site, [&state] { state.progress(kLoop); }),
      retry_delay_(kFirstRetry) {
  traffic_.batch = &batch_;
  traffic_.state = &state_;
  traffic_.batch_extended = [this] { schedule_commit(); };
  traffic_.slot_released = [this] {
    if (std::exchange(requests_scheduled_, true)) return;
    boost::asio::post(context_, [this] {
      requests_scheduled_ = false;
      for_each_log([](LogTailer& log) { log.request_page(); });
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
    if (traffic_.database_up && !batch_.empty()) commit();
    for (auto& [gyro, source] : sources_) source.instance->close();
    context_.stop();
  });
}

template <class Action>
void DatabaseLoop::for_each_log(Action&& action) {
  for (auto& [gyro, source] : sources_) {
    for (const auto& log : source.logs) action(*log);
  }
}

void DatabaseLoop::connect() {
  if (const auto done = database_.connect(); !done) return on_error(done.error());
  if (!batch_failed_) state_.up(kServer);
  last_contact_ = steady_clock::now();
  traffic_.database_up = true;
  keep_days();
  if (!traffic_.database_up) return;
  for_each_log([this](LogTailer& log) { log.resume(database_.stored_cursor(log.log())); });
  for (auto& [gyro, source] : sources_) {
    if (!source.instance->running()) continue;
    source.instance->call("events", {{"count", kEvents}},
                          [this, name = gyro](const client::Response& events) { add_events(name, events); });
  }
}

// Discards the batch: connect() reads the position of each log from the database.
void DatabaseLoop::on_error(const Error& error) {
  state_.down(kServer, error.text());
  traffic_.database_up = false;
  batch_ = {};
  commit_timer_.cancel();
  commit_scheduled_ = false;
  for_each_log([](LogTailer& log) { log.discarded(); });
  retry_timer_.expires_after(scaled(retry_delay_));
  retry_delay_ = std::min(retry_delay_ * 2, std::chrono::milliseconds(kLongestRetry));
  retry_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) connect();
  });
}

// Adds the stored events of prismd, including those before the connection. The table ignores duplicates.
void DatabaseLoop::add_events(const std::string& gyro, const client::Response& events) {
  if (!traffic_.database_up || !events || !events->is_array()) return;
  for (const json& event : *events) batch_.add_event(gyro, event);
  schedule_commit();
}

void DatabaseLoop::schedule_commit() {
  if (batch_.bytes() >= kLargeBatch) return commit();
  if (batch_.empty() || std::exchange(commit_scheduled_, true)) return;
  commit_timer_.expires_after(std::chrono::milliseconds(static_cast<int>(settings_.postgresql->gather_s * 1000)));
  commit_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) commit();
  });
}

void DatabaseLoop::commit() {
  commit_scheduled_ = false;
  commit_timer_.cancel();
  if (batch_.empty() || !traffic_.database_up) return;
  const auto refusals = database_.commit(batch_);
  if (!refusals) {
    batch_failed_ = true;
    return on_error(refusals.error());
  }
  const std::map<LogKey, Refusal> by_log = report(*refusals);
  batch_ = {};
  batch_failed_ = false;
  retry_delay_ = kFirstRetry;
  state_.up(kServer);
  state_.committed(kServer);
  last_contact_ = steady_clock::now();
  for_each_log([&](LogTailer& log) {
    const auto refusal = by_log.find(log.log());
    log.committed(refusal == by_log.end() ? Refusal() : refusal->second);
  });
}

// Returns the refusals of pages, which their tailers report; logs those of events and changes of logs.
std::map<LogKey, Refusal> DatabaseLoop::report(const std::vector<Refusal>& refusals) {
  std::map<LogKey, Refusal> by_log;
  for (std::size_t i = 0; i < refusals.size(); ++i) {
    const BatchItem& item = batch_.items()[i];
    if (refusals[i].first.empty() && refusals[i].error.empty()) continue;
    if (!item.cursor.empty()) {
      by_log[item.log] = refusals[i];
    } else {
      log_line(Level::kWarning,
               fmt::format("{}: PostgreSQL refused {}; it is not stored", item.log.gyro, refusals[i].first));
    }
  }
  return by_log;
}

void DatabaseLoop::keep_days() {
  partitions_checked_ = steady_clock::now();
  const auto dropped = database_.keep_days();
  if (!dropped) return on_error(dropped.error());
  for (const std::string& line : *dropped) log_line(Level::kWarning, line);
}

void DatabaseLoop::discover() {
  update_sources(
      sources_, settings_, state_,
      [this](const std::string& gyro, const std::string&, const std::string& socket) { follow(gyro, socket); },
      [](Source& source) {
        for (const auto& log : source.logs) log->close();
      });
}

void DatabaseLoop::follow(const std::string& gyro, const std::string& socket) {
  Source& source = sources_[gyro];
  InstanceClient::Callbacks callbacks;
  callbacks.connected = [this, &source](const json& status) { on_connected(source, status); };
  callbacks.notification = [this, gyro](const json& message) {
    if (member(message, "method") != "event" || !traffic_.database_up) return;
    batch_.add_event(gyro, member(message, "params"));
    schedule_commit();
  };
  callbacks.disconnected = [&source] {
    for (const auto& log : source.logs) log->close();
  };
  source.instance = std::make_shared<InstanceClient>(context_, state_, gyro, socket, std::move(callbacks));
  source.instance->start();
}

// Commits first, because the batch may contain rows of the previous tailers, which are deleted here.
void DatabaseLoop::on_connected(Source& source, const json& status) {
  if (traffic_.database_up && !batch_.empty()) commit();
  for (const auto& log : source.logs) log->close();
  source.logs.clear();
  const std::string& gyro = source.instance->gyro();
  const StatusAxes axes = axes_of(status);
  for (const std::string& name : axes.invalid) state_.log_skipped_axis(gyro, name);
  for (const std::string& axis : axes.names) {
    auto log = std::make_shared<LogTailer>(context_, traffic_, LogKey{gyro, axis});
    const std::weak_ptr<InstanceClient> instance = source.instance;
    log->open(source.instance->socket(), [instance](const std::string& reason) {
      if (const auto client = instance.lock(); client && client->running()) client->restart(reason);
    });
    source.logs.push_back(log);
  }
  const auto on_events = [this, gyro](const client::Response& events) { add_events(gyro, events); };
  source.instance->call("subscribe", {{"streams", {"event"}}}, [](const client::Response&) {});
  source.instance->call("events", {{"count", kEvents}}, on_events);
  if (!traffic_.database_up) return;
  for (const auto& log : source.logs) log->resume(database_.stored_cursor(log->log()));
}

void DatabaseLoop::once_a_second() {
  state_.progress(kLoop);
  discover();
  const auto now = steady_clock::now();
  for (auto& [gyro, source] : sources_) {
    const auto is_unresponsive = [&](const auto& log) { return log->is_unresponsive(now); };
    if (std::any_of(source.logs.begin(), source.logs.end(), is_unresponsive))
      source.instance->restart("does not respond");
  }
  for_each_log([](LogTailer& log) { log.request_page(); });
  if (traffic_.database_up && now - last_contact_ > scaled(kIdle)) {
    last_contact_ = now;
    const auto done = database_.ping();
    if (!done) {
      on_error(done.error());
    } else if (batch_.empty() && std::exchange(batch_failed_, false)) {
      state_.up(kServer);  // the refused rows are no longer offered, e.g. because the gyro stopped
    }
  }
  if (!traffic_.database_up && now - retention_checked_ > scaled(kRetentionEvery)) {
    retention_checked_ = now;
    for_each_log([](LogTailer& log) { log.check_retention(); });
  }
  if (traffic_.database_up && now - partitions_checked_ > kPartitionsEvery) keep_days();
  second_timer_.expires_after(scaled(1s));
  second_timer_.async_wait([this](boost::system::error_code stopped) {
    if (!stopped) once_a_second();
  });
}

}  // namespace prism::prismrelay
