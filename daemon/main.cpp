// SPDX-License-Identifier: MIT
// prismd: acquire, compensate, log, publish.
#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>

#include "daemon/message_thread.hpp"
#include "daemon/service.hpp"
#include "daemon/sniff.hpp"

namespace prism::daemon {
namespace {

// "<4>": the syslog priority that the journal reads off the front of a line.
class JournalPriority : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const char* priority = message.level >= spdlog::level::err    ? "<3>"
                           : message.level >= spdlog::level::warn ? "<4>"
                           : message.level >= spdlog::level::info ? "<6>"
                                                                  : "<7>";
    out.append(priority, priority + 3);
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override { return std::make_unique<JournalPriority>(); }
};

/// Messages leave by a thread of their own: who does not read them holds up nobody.
class QueueSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  bool finish(std::chrono::milliseconds patience) { return messages_.finish(patience); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t text;
    formatter_->format(message, text);
    messages_.put(fmt::to_string(text));
  }
  void flush_() override {}

 private:
  MessageThread messages_{STDERR_FILENO};
};

std::shared_ptr<QueueSink> stderr_sink;

// To stderr. Under systemd the journal has its own times and takes the severity from a prefix, "<4>".
void begin_logging(const std::string& level) {
  const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  stderr_sink = std::make_shared<QueueSink>();
  auto logger = std::make_shared<spdlog::logger>("prismd", stderr_sink);
  if (journal) {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalPriority>('*').set_pattern("%*%v");
    logger->set_formatter(std::move(formatter));
  } else {
    logger->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ prismd %l: %v", spdlog::pattern_time_type::utc);
  }
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

}  // namespace

void finish_logging() {
  if (stderr_sink) stderr_sink->finish(std::chrono::milliseconds(500));
}

void log_event(const Event& event) {
  const auto level = event.severity == Severity::kError     ? spdlog::level::err
                     : event.severity == Severity::kWarning ? spdlog::level::warn
                     : event.severity == Severity::kInfo    ? spdlog::level::info
                                                            : spdlog::level::debug;
  if (event.repeats > 0) {
    spdlog::log(level, "{} ({} more times since it was last said)", event.text, event.repeats);
  } else {
    spdlog::log(level, "{}", event.text);
  }
}

namespace {

int check(const pipeline::Setup& setup) {
  const config::Config& config = setup.config;
  for (const std::string& note : setup.notes) fmt::print("note: {}\n", note);
  fmt::print("{}: good: frames {} ({:g} Hz), model {}, line {}\n", config.path, setup.frames->name,
             setup.frames->rate_hz,
             setup.model ? setup.model->info().id.substr(0, 12) + " " + setup.model->info().name : "none",
             config.line.device.empty() ? "none" : config.line.device);
  return kExitDone;
}

int run(int argc, char** argv) {
  Options options;
  if (const auto code = parse_options(argc, argv, options)) return *code;
  if (!options.sniff.empty()) return run_sniff(options.sniff, options.config);
  if (options.check) {
    if (const int code = check_document(options.config); code >= 0) return code;
  }
  Result<pipeline::Setup> setup = pipeline::load_setup(options.config, overrides_of(options));
  if (!setup) {
    fmt::print(stderr, "prismd: {}\n", setup.error().text());
    return kExitConfig;
  }
  if (setup->config.line.device.empty() && options.replay.empty()) {
    fmt::print(stderr, "prismd: {}:/line/device: is missing, expected the gyro's serial device (or use --replay)\n",
               setup->config.path);
    return kExitConfig;
  }
  begin_logging(setup->config.event_level);
  if (options.check) return check(*setup);
  const int code =
      options.replay.empty() ? run_live(options, std::move(*setup)) : run_replay(options, std::move(*setup));
  finish_logging();
  return code;
}

}  // namespace
}  // namespace prism::daemon

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader of stderr that is gone ends nothing
  try {
    return prism::daemon::run(argc, argv);
  } catch (const std::exception& bug) {
    fmt::print(stderr, "prismd: internal error: {}; please report it\n", bug.what());
    return prism::daemon::kExitBug;
  }
}
