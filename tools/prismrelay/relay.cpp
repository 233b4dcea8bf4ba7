// SPDX-License-Identifier: MIT
#include "tools/prismrelay/relay.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/host_time.hpp"
#include "base/json_member.hpp"
#include "base/notify.hpp"
#include "base/outside_text.hpp"
#include "base/plain_text.hpp"
#include "base/problems.hpp"
#include "base/text_number.hpp"
#include "base/time_scale.hpp"
#include "config/version.hpp"
#include "tools/client/client.hpp"
#include "tools/client/instances.hpp"
#include "tools/prismrelay/database.hpp"
#include "tools/prismrelay/mqtt.hpp"

namespace prism::prismrelay {
namespace {

namespace asio = boost::asio;
using client::Client;
using client::kUse;
using nlohmann::json;
using std::chrono_literals::operator""h;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;
using Clock = std::chrono::steady_clock;

constexpr auto kLookEvery = 1s, kStatusEvery = 5s, kReportEvery = 2s;
constexpr int kEvents = 256;  // a prismd stores at most these
// Pages of logs. A page has at most 256 KiB: kMaxLarge limits the memory if a thousand logs are behind. A page with
// refused rows is stored row by row: small ones delay the other gyros less.
constexpr int kLargePage = 2000, kSmallPage = 50, kMaxLarge = 48;
constexpr int kWait_s = 10;
constexpr auto kRowsTimeout = 40s, kErrorDelay = 5s;
constexpr auto kRetentionEvery = 60s;         // while the database is down
constexpr std::size_t kLargeBatch = 4 << 20;  // bytes; committed immediately
constexpr auto kFirstRetry = 500ms, kLongestRetry = 60'000ms;
constexpr auto kIdle = 5s;             // then the connection is checked by an empty commit
constexpr auto kPartitionsEvery = 1h;  // creates partitions in advance and drops old ones
constexpr int kCalmPages = 60;         // without a fault, before its end is logged: about a minute
constexpr std::size_t kMaxWarnings = 1000;
constexpr auto kSlow = 20s;  // of the database or a disk: reported, and waited for

class Relay {
 public:
  explicit Relay(const Settings& settings)
      : settings_(settings), problems_([](bool begins, const std::string&, const std::string& text) {
          log_line(begins ? Level::kWarning : Level::kInfo, text);
        }) {
    if (settings.mqtt) mqtt_.emplace(io_, *settings.mqtt, settings.site, broker_target_);
  }

  void run() {
    signals_.async_wait([this](boost::system::error_code, int) { stop(); });
    if (mqtt_) start(mqtt_->run());
    if (settings_.postgresql) start(store_rows());
    start(look_for_gyros());
    start(write_reports());
    notify_ready("looking for gyros");
    log_line(Level::kInfo,
             fmt::format("sending the rows of {} as site {}", fmt::join(settings_.instances, ", "), settings_.site));
    io_.run();
    if (late_ > 0) std::_Exit(0);  // a thread does not end
    database_thread_.join();
    file_thread_.join();
    log_line(Level::kInfo, "stopped");
  }

 private:
  /// The log of one axis. At most one page is in progress, from its request to its commit.
  struct Log {
    Log(asio::io_context& io, const std::string& socket, LogKey log_key)
        : key(std::move(log_key)), client(io, socket, kRowsTimeout), wake(io) {}

    const LogKey key;
    const std::string name = key.gyro + " " + key.axis;  // in messages
    Client client;
    asio::steady_timer wake;          // cancelled after a commit and a connection of the database
    std::shared_ptr<BatchItem> item;  // the last page
    bool is_behind = true, had_refusals = false;

    std::uint64_t rows = 0, invalid = 0, missing = 0;  // since the relay follows the log
    std::string error;                                 // error or invalid response of prismd
    std::string rows_error;                            // set by a page without a valid row, cleared by a valid row
    double arrival_s = 0;                              // of the last committed row
    double lag_s = 0;                                  // from its arrival to its commit
    bool caught_up = false;

    /// Why no rows are sent; empty if they are.
    const std::string& fault() const { return error.empty() ? rows_error : error; }
  };
  struct Gyro {
    Gyro(asio::io_context& io, std::string gyro_key, const std::string& socket)
        : key(std::move(gyro_key)), client(io, socket) {}

    const std::string key;  // SITE/NAME
    Client client;
    std::string state = "new";  // then "running", "stopped" (a connection would start it) or "gone"
    std::string error;
    bool is_published = false;  // to the broker
    std::set<std::string> axes;
    std::map<std::string, std::shared_ptr<Log>> logs;  // by axis
    std::uint64_t events_generation = 0;               // of the database that has the events
  };

  void stop() {
    notify_stopping();
    if (!mqtt_) return io_.stop();
    for (const auto& [name, gyro] : gyros_) {
      for (const std::string& axis : gyro->axes) publish_gone(*gyro, axis);
    }
    mqtt_->finish();
  }

  void warn_once(const std::string& text) {
    if (warnings_.size() < kMaxWarnings && warnings_.insert(text).second) log_line(Level::kWarning, text);
  }

  // Runs `work` in the thread and returns its result in the loop. Calls `late` if it lasts longer than kSlow.
  template <class Work, class Late>
  asio::awaitable<std::invoke_result_t<Work>> in_thread(asio::thread_pool& thread, Work work, Late late) {
    std::optional<std::invoke_result_t<Work>> result;
    asio::steady_timer done(io_, scaled(kSlow));
    asio::post(thread, [&] {
      auto value = work();
      asio::post(io_, [&, value = std::move(value)]() mutable {
        result.emplace(std::move(value));
        done.cancel();
      });
    });
    co_await done.async_wait(kUse);
    if (!result) {
      ++late_;
      late();
      done.expires_at(Clock::time_point::max());
      co_await done.async_wait(kUse);
      --late_;
    }
    co_return std::move(*result);
  }

  template <class Work>
  asio::awaitable<std::invoke_result_t<Work>> in_database(Work work) {
    const auto late = [this] { database_target_.down("postgresql: no response for 20 s"); };
    co_return co_await in_thread(database_thread_, work, late);
  }

  asio::awaitable<void> sleep(Clock::duration time) {
    asio::steady_timer timer(io_, scaled(time));
    co_await timer.async_wait(kUse);
  }

  // An exception is a bug: it ends the program.
  void start(asio::awaitable<void> work) {
    asio::co_spawn(io_, std::move(work), [](const std::exception_ptr& bug) {
      if (bug) std::rethrow_exception(bug);
    });
  }

  // Removes those that are neither configured nor running.
  asio::awaitable<void> look_for_gyros() {
    for (;;) {
      std::vector<std::string> invalid;
      std::map<std::string, std::string> found;  // the first of equal names
      for (const auto& [name, path] : client::list_instances(settings_.instances, &invalid))
        found.try_emplace(settings_.site + "/" + name, path);
      for (const std::string& path : invalid)
        warn_once(fmt::format("{}: skipped: expected a name of {}", path, rule_text(TextRule::kName)));
      for (const auto& [key, socket] : found) {
        if (!gyros_.contains(key)) add_gyro(key, socket);
      }
      std::erase_if(gyros_, [&](const auto& entry) {
        Gyro& gyro = *entry.second;
        if (found.contains(gyro.key) || gyro.state == "running") return false;
        gyro.client.close();
        for (const auto& [axis, log] : gyro.logs) log->client.close();
        log_line(Level::kInfo, gyro.key + ": socket removed, gyro no longer followed");
        return true;
      });
      notify_watchdog();
      co_await sleep(kLookEvery);
    }
  }

  void add_gyro(const std::string& key, const std::string& socket) {
    const auto gyro = gyros_[key] = std::make_shared<Gyro>(io_, key, socket);
    gyro->is_published = mqtt_ && is_topic_part(gyro->client.name());
    if (mqtt_ && !gyro->is_published)
      warn_once(fmt::format("mqtt: the gyro \"{}\" is not published: MQTT reserves +, # and a leading $ in topics",
                            gyro->client.name()));
    start(follow(gyro));
  }

  asio::awaitable<void> follow(std::shared_ptr<Gyro> gyro) {
    gyro->client.on_notification = [this, &gyro](std::string_view line) { on_notification(*gyro, line); };
    gyro->client.on_end = [this, &gyro](client::State state, const std::string& reason) {
      const bool is_stopped = state == client::State::kStopped;
      change_state(*gyro, is_stopped ? "stopped" : "gone", is_stopped ? "" : reason);
    };
    const Client::Session session = [this, &gyro] { return watch(*gyro); };
    co_await gyro->client.run(session);
  }

  // A connection for short requests and notifications.
  asio::awaitable<std::string> watch(Gyro& gyro) {
    const json streams = {{"streams", mqtt_ ? json{"window", "event"} : json{"event"}}};
    const json count = {{"count", kEvents}};
    gyro.events_generation = 0;
    for (;;) {
      const bool is_first = gyro.state != "running";
      if (is_first || mqtt_) {
        auto status = co_await gyro.client.ask("status");
        if (!status) co_return status.error().error.what;
        on_status(gyro, *status);
      }
      if (is_first) {
        const auto subscribed = co_await gyro.client.ask("subscribe", streams);
        if (!subscribed) co_return subscribed.error().error.what;
      }
      // The stored events of prismd, including those before the connection. The table ignores duplicates.
      if (database_up_ && gyro.events_generation != generation_) {
        const auto events = co_await gyro.client.ask("events", count);
        gyro.events_generation = generation_;
        if (events && events->is_array()) {
          for (const json& event : *events) add(event_item(gyro.key, event));
        }
      }
      co_await sleep(kStatusEvery);
    }
  }

  void on_notification(const Gyro& gyro, std::string_view line) {
    const auto message = parse_json_line(line);
    if (!message) return;
    const std::string method = text_member(*message, "method");
    const json& params = member(*message, "params");
    const std::string axis = text_member(params, "axis");
    if (method == "event") add(event_item(gyro.key, params));
    if (!gyro.is_published) return;
    if (method == "event") mqtt_->publish_once(gyro.client.name() + "/event", json_text(params));
    if (method == "window" && gyro.axes.contains(axis))
      mqtt_->publish_last(fmt::format("{}/{}/window", gyro.client.name(), axis), json_text(params), false);
    if (method == "lost") broker_target_.dropped += count_member(params, "rows");
  }

  void on_status(Gyro& gyro, const json& status) {
    const std::set<std::string> before = std::exchange(gyro.axes, {});
    for (const auto& [axis, members] : member(status, "axes").items()) {
      if (follows(TextRule::kAxisName, axis)) {
        gyro.axes.insert(axis);
      } else {
        warn_once(
            fmt::format("{} axis {}: skipped: expected {}", gyro.key, shortened(axis), rule_text(TextRule::kAxisName)));
      }
    }
    change_state(gyro, "running", "");
    for (const std::string& axis : gyro.axes) {
      if (gyro.is_published) {
        json axis_status = client::with_axis(status, axis);
        axis_status["state"] = "running";
        mqtt_->publish_last(fmt::format("{}/{}/status", gyro.client.name(), axis), json_text(axis_status), true);
      }
      if (!settings_.postgresql || gyro.logs.contains(axis)) continue;
      const auto log = std::make_shared<Log>(io_, gyro.client.socket(), LogKey{gyro.key, axis});
      gyro.logs[axis] = log;
      start(follow_log(log));
    }
    for (const std::string& axis : before) {
      if (gyro.axes.contains(axis)) continue;
      publish_gone(gyro, axis);
      if (const auto log = gyro.logs.extract(axis)) log.mapped()->client.close();
    }
  }

  void change_state(Gyro& gyro, const std::string& state, const std::string& error) {
    const std::string before = std::exchange(gyro.state, state), shown = printable(error);
    const bool changed = before != state || (gyro.error != shown && !shown.empty());
    gyro.error = shown;
    if (before == "running" && state != "running") {
      for (const std::string& axis : gyro.axes) publish_gone(gyro, axis);
    }
    if (changed)
      log_line(state == "gone" && before != "new" ? Level::kWarning : Level::kInfo,
               fmt::format("{}: {}{}{}", gyro.key, state, error.empty() ? "" : ": ", error));
  }

  // Replaces the retained status, which is no longer true. A broker keeps it until the next message.
  void publish_gone(const Gyro& gyro, const std::string& axis) {
    if (!gyro.is_published) return;
    const std::string text = gone_text(axis);
    mqtt_->publish_last(fmt::format("{}/{}/status", gyro.client.name(), axis), text, true);
    mqtt_->publish_last(fmt::format("{}/{}/window", gyro.client.name(), axis), text, false);
  }

  asio::awaitable<void> follow_log(std::shared_ptr<Log> log) {
    const Client::Session session = [this, &log] { return read_rows(*log); };
    co_await log->client.run(session);
  }

  asio::awaitable<void> wait(Log& log, Clock::duration time) {
    log.wake.expires_after(time);
    co_await log.wake.async_wait(kUse);
  }

  // Requests rows only after the cursor in the database. While the database is down, it asks how far the log is behind.
  asio::awaitable<std::string> read_rows(Log& log) {
    for (;;) {
      while (log.item && !log.item->is_done) co_await wait(log, 1h);
      if (const auto item = std::exchange(log.item, nullptr); item && item->is_stored) {
        on_stored(log, *item);
        if (!item->cursor_error.empty()) co_await sleep(kErrorDelay);
      }
      while (generation_ == 0 || (database_up_ && log.is_behind && large_pages_.use_count() > kMaxLarge))
        co_await wait(log, scaled(1s));
      const bool up = database_up_, is_large = up && log.is_behind;
      const std::uint64_t generation = generation_;
      const auto known = cursors_.find(log.key);
      const std::string cursor = known == cursors_.end() ? "earliest" : known->second;
      const json params = {{"after", cursor},
                           {"limit", !up                             ? 1
                                     : is_large && !log.had_refusals ? kLargePage
                                                                     : kSmallPage},
                           {"wait_s", up && !log.is_behind ? kWait_s : 0},
                           {"axis", log.key.axis}};
      const auto slot = is_large ? large_pages_ : nullptr;
      auto response = co_await log.client.ask("rows", params);
      if (log.client.state() != client::State::kConnected) co_return "";
      if (response) watch_retention(log, client::of_axis(*response, log.key.axis));
      if (!up && !database_up_) co_await wait(log, scaled(kRetentionEvery));
      if (!up || !database_up_ || generation != generation_) continue;  // the cursor may be another one now
      std::string error;
      if (response) {
        auto page = page_item(log.key, cursor, std::move(*response));
        if (!page) error = page.error().text();
        if (page) log.item = std::move(*page);
      } else if (response.error().code == config::kUnknownCursor && cursor != "earliest") {
        // The log directory was emptied: prismd has a new log.
        log_line(Level::kWarning, fmt::format("{}: {}; reading the current log from its start", log.name,
                                              printable(response.error().error.what)));
        cursors_[log.key] = "earliest";
        add(change_item(log.key, cursor));
        continue;
      } else {
        error = printable(response.error().error.what);
      }
      log.error = error;
      if (!error.empty()) {
        report_log(log);
        co_await sleep(kErrorDelay);
        continue;
      }
      log.is_behind = log.item->more;
      if (log.item->is_empty()) {  // the cursor is unchanged
        log.item = nullptr;
        log.caught_up = log.caught_up || !log.is_behind;
        report_log(log);
        continue;
      }
      add(log.item);
      while (!log.item->is_done) co_await wait(log, 1h);
    }
  }

  void report_log(const Log& log) {
    if (log.fault().empty()) return problems_.clear(log.name, log.name + ": rows are sent again", kCalmPages);
    problems_.set(log.name, {.text = log.name + ": " + log.fault()});
  }

  // Warns if more than half of the rows that prismd keeps are not in the database, and it deletes rows.
  void watch_retention(const Log& log, const json& page) {
    const std::uint64_t behind = count_member(page, "behind"), kept = count_member(page, "kept");
    const std::string key = "late " + log.name;
    if (count_member(page, "deleted") == 0 || 2 * behind <= kept)
      return problems_.clear(key, log.name + ": less than half of the kept rows behind again");
    problems_.set(key, {.text = fmt::format("{}: {} behind, more than half of those that prismd keeps (log/keep_mib, "
                                            "log/keep_days): it will delete rows that the database does not have",
                                            log.name, counted(behind, "row"))});
  }

  // After a commit, a connection or its loss.
  void wake_logs() {
    for (const auto& [name, gyro] : gyros_) {
      for (const auto& [axis, log] : gyro->logs) log->wake.cancel();
    }
  }

  // Connects to the database and stores the batches, again after each error. connect() reads the cursors: rows that
  // were not stored are requested again.
  asio::awaitable<void> store_rows() {
    const auto connect = [this] { return prismrelay::connect(*settings_.postgresql, settings_.site, database_); };
    const auto close = [this] { return database_ = nullptr; };
    std::chrono::milliseconds pause = kFirstRetry;
    for (;;) {
      auto cursors = co_await in_database(connect);
      if (cursors) {
        if (!commit_failed_) database_target_.up();
        cursors_ = std::move(*cursors);
        ++generation_;
        database_up_ = true;
        wake_logs();
        const Error error = co_await store_batches(pause);
        database_up_ = false;
        for (const auto& item : std::exchange(batch_, {})) item->is_done = true;
        batch_bytes_ = 0;
        wake_logs();
        database_target_.down(error.text());
      } else {
        database_target_.down(cursors.error().text());
      }
      co_await in_database(close);
      co_await sleep(pause);
      pause = std::min<std::chrono::milliseconds>(2 * pause, kLongestRetry);
    }
  }

  // Returns the error that ends the connection. `pause` grows until a commit.
  asio::awaitable<Error> store_batches(std::chrono::milliseconds& pause) {
    Batch batch;
    const auto keep_days = [this] { return keep_partitions(*database_, settings_.postgresql->keep_days); };
    const auto commit = [this, &batch] { return prismrelay::commit(*database_, batch); };
    for (Clock::time_point partitions_due;;) {
      if (Clock::now() >= partitions_due) {
        const auto dropped = co_await in_database(keep_days);
        if (!dropped) co_return dropped.error();
        for (const std::string& line : *dropped) log_line(Level::kWarning, line);
        partitions_due = Clock::now() + kPartitionsEvery;
      }
      co_await gather();
      batch = std::exchange(batch_, {});  // empty: the connection is checked
      batch_bytes_ = 0;
      const auto done = co_await in_database(commit);
      // Without new rows, those that failed are no longer offered.
      if (!batch.empty() || (done && batch_.empty())) commit_failed_ = !done;
      for (const auto& item : batch) {
        item->is_done = true;
        item->is_stored = done.has_value();
        if (done) report_refusal(*item);
        if (done && !item->cursor.empty() && item->cursor_error.empty()) cursors_[item->log] = item->cursor;
      }
      if (!done) co_return done.error();
      if (!commit_failed_) database_target_.up();
      if (batch.empty()) continue;
      wake_logs();
      pause = kFirstRetry;
      database_target_.last_s = host_time_s();
    }
  }

  // Returns gather_s after the first item of the batch, as soon as it is large, or without an item after kIdle.
  asio::awaitable<void> gather() {
    if (batch_.empty()) batch_timer_.expires_after(scaled(kIdle));
    bool is_interrupted = true;  // by add()
    while (is_interrupted) is_interrupted = std::get<0>(co_await batch_timer_.async_wait(kUse)).failed();
  }

  void add(std::shared_ptr<BatchItem> item) {
    if (!item) return;
    if (!database_up_) return void(item->is_done = true);  // requested again
    if (batch_.empty())
      batch_timer_.expires_after(std::chrono::milliseconds(static_cast<int>(settings_.postgresql->gather_s * 1000)));
    for (const std::string& text : item->texts) batch_bytes_ += text.size();
    batch_.push_back(std::move(item));
    // The database works while further pages arrive: it takes every page that came.
    if (batch_.back()->more || batch_bytes_ >= kLargeBatch) batch_timer_.expires_after(0s);
  }

  void report_refusal(const BatchItem& item) {
    const std::string name = item.log.gyro + (item.log.axis.empty() ? "" : " " + item.log.axis);
    if (item.refusal.empty())
      return problems_.clear("refused " + name, name + ": PostgreSQL accepts the rows again", kCalmPages);
    problems_.set("refused " + name,
                  {.text = fmt::format("{}: PostgreSQL refused {}; {}", name, item.refusal,
                                       item.cursor.empty() ? "it is not stored" : "see prism.refused_rows")});
  }

  void on_stored(Log& log, const BatchItem& item) {
    const std::vector<Record>& rows = item.records[kRows];
    const auto read = rows.size();
    const auto refused = static_cast<std::size_t>(std::ranges::count_if(rows, &Record::is_refused));
    log.had_refusals = refused > 0;
    if (!item.cursor_error.empty()) {
      log.error = "PostgreSQL refused the cursor: " + item.cursor_error;
      return report_log(log);
    }
    if (read > refused) log.rows_error.clear();
    if (read == refused && item.invalid + refused > 0)
      log.rows_error = "no valid row; last error: " + (item.error.empty() ? item.refusal : item.error);
    log.rows += read - refused;
    log.invalid += item.invalid + refused;
    log.missing += item.missing;
    log.caught_up = !item.more;
    if (read > 0) {
      log.arrival_s = 1e-9 * static_cast<double>(rows.back().arrival_ns);
      log.lag_s = host_time_s() - log.arrival_s;
    }
    report_log(log);
  }

  // Age of the last committed row if the log may have further rows: the database is down, the log has an error or is
  // not read to its end. Else 0, also before the first commit.
  double behind_s(const Log& log) const {
    const bool up_to_date = database_target_.is_up && log.caught_up && log.fault().empty();
    return up_to_date || log.arrival_s == 0 ? 0 : std::max(0.0, host_time_s() - log.arrival_s);
  }

  // {"format":"prismrelay-status","version":1,"time_s",…,"targets":{…},"instances":{…},"logs":[…]}; without passwords.
  json status() const {
    json status = {{"format", "prismrelay-status"}, {"version", 1},
                   {"program", kVersion},           {"pid", ::getpid()},
                   {"time_s", host_time_s()},       {"site", settings_.site},
                   {"targets", json::object()},     {"instances", json::object()},
                   {"logs", json::array()}};
    if (settings_.postgresql) status["targets"]["postgresql"] = database_target_.status();
    if (mqtt_) status["targets"]["mqtt"] = broker_target_.status();
    for (const auto& [key, gyro] : gyros_) {
      status["instances"][key] = {{"state", gyro->state}, {"socket", gyro->client.socket()}, {"error", gyro->error}};
      for (const auto& [axis, log] : gyro->logs) {
        const bool has_rows = log->arrival_s > 0;
        status["logs"].push_back({{"gyro", key},
                                  {"axis", axis},
                                  {"rows", log->rows},
                                  {"refused_rows", log->invalid},
                                  {"missing_rows", log->missing},
                                  {"caught_up", log->caught_up && log->fault().empty()},
                                  {"behind_s", behind_s(*log)},
                                  {"lag_s", has_rows ? json(log->lag_s) : json()},
                                  {"last_row_s", has_rows ? json(log->arrival_s) : json()},
                                  {"error", log->fault()}});
      }
    }
    return status;
  }

  // For systemd: "30 of 31 gyros run; mqtt: down: …; postgresql: up, 3 s behind".
  std::string summary() const {
    std::size_t running = 0, failing = 0;
    double behind = 0;
    for (const auto& [key, gyro] : gyros_) {
      running += gyro->state == "running" ? 1 : 0;
      for (const auto& [axis, log] : gyro->logs) {
        behind = std::max(behind, behind_s(*log));
        failing += log->fault().empty() ? 0 : 1;
      }
    }
    std::string text = fmt::format("{} of {} gyros run", running, gyros_.size());
    if (mqtt_) text += broker_target_.text();
    if (settings_.postgresql) text += database_target_.text();
    if (behind > 0) text += fmt::format(", {:.0f} s behind", behind);
    if (failing > 0) text += ", rows of " + counted(failing, "log") + " fail";
    return text;
  }

  asio::awaitable<void> write_reports() {
    std::string notified, text;
    const auto write = [&] { return write_text_file(settings_.status_file, text); };
    const auto late = [this] { problems_.set("status", {.text = "cannot write the status: no response of the disk"}); };
    for (;;) {
      if (std::string line = summary(); line != notified) notify_status(notified = std::move(line));
      text = json_text(status(), 2) + "\n";
      const auto written = co_await in_thread(file_thread_, write, late);
      if (written) problems_.clear("status", "the status is written again");
      if (!written) problems_.set("status", {.text = "cannot write the status: " + written.error().text()});
      co_await sleep(kReportEvery);
    }
  }

  const Settings& settings_;
  Target database_target_{"postgresql"}, broker_target_{"mqtt"};
  Problems problems_;
  std::set<std::string> warnings_;
  const std::shared_ptr<int> large_pages_ = std::make_shared<int>();  ///< used once more by each large page in progress
  int late_ = 0;
  asio::io_context io_{1};
  asio::signal_set signals_{io_, SIGTERM, SIGINT};
  std::optional<Mqtt> mqtt_;
  std::map<std::string, std::shared_ptr<Gyro>> gyros_;  ///< by name

  std::shared_ptr<Session> database_;  ///< used in its thread only
  bool database_up_ = false;
  std::uint64_t generation_ = 0;           ///< number of connections of the database
  std::map<LogKey, std::string> cursors_;  ///< of each log: in the database
  Batch batch_;                            ///< the next one
  std::size_t batch_bytes_ = 0;
  asio::steady_timer batch_timer_{io_};
  bool commit_failed_ = false;  ///< the last one: the server is reported as down until the next one

  asio::thread_pool database_thread_{1}, file_thread_{1};
};

}  // namespace

void log_line(Level level, const std::string& text) {
  static const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  if (journal) return fmt::print(stderr, "<{}>{}\n", static_cast<int>(level), printable(text));
  fmt::print(stderr, "{} prismrelay {}: {}\n", utc_text(static_cast<std::int64_t>(host_time_s())),
             level == Level::kWarning ? "warning" : "info", printable(text));
}

void Target::up() {
  error.clear();
  if (std::exchange(is_up, true)) return;
  since_s = host_time_s();
  log_line(Level::kInfo, name + ": connected");
}

void Target::down(const std::string& reason) {
  ++failures;
  if (is_up || since_s == 0) since_s = host_time_s();
  const bool changed = std::exchange(is_up, false) || error != printable(reason);
  error = printable(reason);
  if (changed) log_line(Level::kWarning, reason + "; retrying");
}

json Target::status() const {
  const auto time = [](double time_s) { return time_s > 0 ? json(time_s) : json(); };
  return {{"up", is_up},          {"since_s", time(since_s)},    {"error", error},
          {"failures", failures}, {"dropped_messages", dropped}, {"last_s", time(last_s)}};
}

std::string Target::text() const {
  return fmt::format("; {}: {}{}{}", name, is_up ? "up" : "down", error.empty() ? "" : ": ", error);
}

void run_relay(const Settings& settings) {
  std::signal(SIGPIPE, SIG_IGN);
  Relay(settings).run();
}

}  // namespace prism::prismrelay
