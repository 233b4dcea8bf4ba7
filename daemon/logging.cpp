// SPDX-License-Identifier: MIT
#include "daemon/logging.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string_view>

#include "base/escape.hpp"

namespace prism::daemon {
namespace {

// Ignores a closed reader. Waits if a non-blocking descriptor is full.
void write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {
      pollfd wait{descriptor, POLLOUT, 0};
      ::poll(&wait, 1, -1);
    } else if (errno != EINTR) {
      return;
    }
  }
}

// "<4>": the syslog priority that the journal reads at the start of a line.
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

/// Writes messages on a separate thread, so that a blocked stderr does not block the daemon.
class QueueSink : public spdlog::sinks::base_sink<std::mutex> {
 public:
  bool finish(std::chrono::milliseconds timeout) { return messages_.finish(timeout); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string payload = printable({message.payload.data(), message.payload.size()});
    spdlog::details::log_msg safe = message;
    safe.payload = payload;
    spdlog::memory_buf_t text;
    formatter_->format(safe, text);
    messages_.put(fmt::to_string(text));
  }
  void flush_() override {}

 private:
  MessageThread messages_{STDERR_FILENO};
};

std::shared_ptr<QueueSink> stderr_sink;

}  // namespace

void MessageThread::put(const std::string& line) {
  const std::string text =
      (lost_ > 0 ? fmt::format("prismd: lost {} messages: stderr was blocked\n", lost_) : std::string()) + line;
  const bool taken = thread_.post(text.size(), [descriptor = descriptor_, text] { write_all(descriptor, text); });
  lost_ = taken ? 0 : lost_ + 1;
}

void begin_logging(const std::string& level) {
  const bool journal = std::getenv("JOURNAL_STREAM") != nullptr;
  stderr_sink = std::make_shared<QueueSink>();
  auto logger = std::make_shared<spdlog::logger>("prismd", stderr_sink);
  if (journal) {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalPriority>('*').set_pattern("%*%v");
    logger->set_formatter(std::move(formatter));
  } else {
    logger->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ prismd: %l: %v", spdlog::pattern_time_type::utc);
  }
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

void finish_logging() {
  if (stderr_sink) stderr_sink->finish(std::chrono::milliseconds(500));
}

void log_event(const socket::Event& event) {
  const auto level = event.severity == pipeline::Severity::kError     ? spdlog::level::err
                     : event.severity == pipeline::Severity::kWarning ? spdlog::level::warn
                     : event.severity == pipeline::Severity::kInfo    ? spdlog::level::info
                                                                      : spdlog::level::debug;
  // Passes formatted text: spdlog's own formatting would compile all of fmt again.
  spdlog::log(level, event.repeats == 0
                         ? event.text
                         : fmt::format("{} ({} more times since the last message)", event.text, event.repeats));
}

}  // namespace prism::daemon
