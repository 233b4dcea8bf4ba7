// SPDX-License-Identifier: MIT
// prismd beside the gyro.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <utility>

#include "daemon/event_loop.hpp"
#include "daemon/live_line.hpp"
#include "daemon/notify.hpp"
#include "daemon/recorder.hpp"
#include "daemon/reloader.hpp"
#include "daemon/row_writers.hpp"
#include "daemon/server.hpp"
#include "daemon/service.hpp"

namespace prism::daemon {
namespace {

namespace asio = boost::asio;
constexpr auto kUse = asio::as_tuple(asio::use_awaitable);
constexpr std::size_t kDiskQueueBytes = 4 << 20;

// Faults found on the disk thread are told on the live one.
std::function<void(const std::string&)> teller(EventLoop& loop, Station*& station) {
  return [&loop, &station](const std::string& what) {
    loop.post([&station, what] {
      if (station != nullptr) station->tell(Severity::kWarning, "disk", what);
    });
  };
}

class Live {
 public:
  Live(const Options& options, Setup setup)
      : disk_(kDiskQueueBytes),
        station_(setup,
                 setup.config.log ? std::make_unique<ThreadedRowWriter>(setup, disk_, teller(loop_, alive_)) : nullptr),
        line_(loop_.io(), station_),
        reloader_(loop_, disk_, options, station_, [this] { line_.reopen(); }),
        rpc_(station_, [this](Reloader::Done done) { reloader_.reload(std::move(done)); }),
        signals_(loop_.io(), SIGINT, SIGTERM, SIGHUP),
        tick_(loop_.io()) {
    alive_ = &station_;
    const config::Config& config = station_.setup().config;
    if (config.capture)
      station_.recorder = std::make_unique<Recorder>(*config.capture, config.name, disk_, teller(loop_, alive_));
  }

  int run() {
    const config::Config& config = station_.setup().config;
    const int inherited = inherited_socket();
    if (!config.socket.path.empty() || inherited >= 0) {
      auto server = Server::open(loop_.io(), config.socket, inherited, station_, rpc_);
      if (!server) {
        spdlog::error("{}", server.error().text());
        return kExitFailed;
      }
      server_ = std::move(*server);
      asio::co_spawn(loop_.io(), server_->serve(), asio::detached);
    }
    for (const std::string& note : station_.setup().notes) station_.tell(Severity::kInfo, "note", note);
    if (!station_.setup().model)
      station_.tell(Severity::kWarning, "no_model",
                    "no model is configured: rates are published uncorrected, marked no_model");
    line_.start();
    asio::co_spawn(loop_.io(), heed_signals(), asio::detached);
    asio::co_spawn(loop_.io(), tick(), asio::detached);
    notify_ready(station_.summary());
    loop_.run(line_);
    notify_stopping();
    station_.finish();
    alive_ = nullptr;
    return kExitDone;
  }

 private:
  asio::awaitable<void> heed_signals() {
    for (;;) {
      auto [error, signal] = co_await signals_.async_wait(kUse);
      if (error) co_return;
      if (signal != SIGHUP) break;
      reloader_.reload([](const Result<std::string>&) {});  // the outcome is an event
    }
    notify_stopping();
    line_.stop();
    loop_.stop();
  }

  // STATUS= once a second; WATCHDOG= only while the line's loop makes progress: data, or a pause that is meant to be.
  asio::awaitable<void> tick() {
    using std::chrono::steady_clock;
    const std::uint64_t half_us = watchdog_half_us();
    const auto period =
        half_us > 0 ? std::min<steady_clock::duration>(std::chrono::microseconds(half_us), std::chrono::seconds(1))
                    : steady_clock::duration(std::chrono::seconds(1));
    std::string shown;
    for (;;) {
      tick_.expires_after(period);
      co_await tick_.async_wait(kUse);
      station_.sync();
      if (half_us == 0 && !under_systemd_) continue;
      if (std::string now = station_.summary(); now != shown) notify_status(shown = std::move(now));
      const auto& line = station_.setup().config.line;
      const auto patience = std::chrono::duration<double>(line.silence_s + 2 * line.retry_max_s + 2);
      if (half_us > 0 && steady_clock::now() - line_.last_progress() < patience) notify_watchdog();
    }
  }

  EventLoop loop_;
  Station* alive_ = nullptr;
  DiskThread disk_;
  Station station_;
  LiveLine line_;
  Reloader reloader_;
  Rpc rpc_;
  asio::signal_set signals_;
  asio::steady_timer tick_;
  std::unique_ptr<Server> server_;
  const bool under_systemd_ = std::getenv("NOTIFY_SOCKET") != nullptr;
};

}  // namespace

int run_live(const Options& options, Setup setup) {
  if (setup.config.line.device.empty()) {
    spdlog::error("{}:/line/device: is missing, expected the gyro's serial device (or use --replay)",
                  setup.config.path);
    return kExitConfig;
  }
  const auto live = std::make_unique<Live>(options, std::move(setup));
  return live->run();
}

}  // namespace prism::daemon
