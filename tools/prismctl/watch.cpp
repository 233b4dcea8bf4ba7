// SPDX-License-Identifier: MIT
// `prismctl watch`: live screen on a terminal, else lines or JSON.
#include "tools/prismctl/watch.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/signal_set.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/outside_text.hpp"
#include "base/text_number.hpp"
#include "tools/client/client.hpp"
#include "tools/prismctl/commands.hpp"
#include "tools/prismctl/views.hpp"
#include "tools/prismctl/words.hpp"

namespace prism::prismctl {
namespace {

namespace asio = boost::asio;
using client::kUse;
using nlohmann::json;

constexpr double kStatusTimeoutS = 3;  ///< status is requested each second
constexpr int kNameColumns = 9, kScaleColumns = 10, kLeftColumns = kNameColumns + kScaleColumns + 2;

struct Span {
  double length_s;
  const char *name, *half;
};
constexpr std::array<Span, 5> kSpans = {{{60, "1 min", "30 s"},
                                         {600, "10 min", "5 min"},
                                         {3600, "1 h", "30 min"},
                                         {21600, "6 h", "3 h"},
                                         {86400, "24 h", "12 h"}}};

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char byte) { return (static_cast<unsigned char>(byte) & 0xC0) != 0x80; }));
}

// Printable, and truncated with "…" to `columns`.
std::string fitted(const std::string& text, std::size_t columns) {
  std::string shown = printable(text);
  if (columns_of(shown) <= columns) return shown;
  std::size_t end = std::min(shown.size(), columns);
  while (end < shown.size() && columns_of(shown.substr(0, end)) < columns) ++end;
  return std::string(utf8_prefix(shown, end - 1)) + "…";
}

std::string scale_text(double value) {
  return std::abs(value) < 1000 ? fmt::format("{:.5f}", value) : fmt::format("{:.4g}", value);
}

// Unicode braille: dots 1-3 and 7 in the left column, 4-6 and 8 in the right one.
std::string braille(unsigned dots) {
  const unsigned code = 0x2800 + dots;
  return {static_cast<char>(0xE0 | code >> 12), static_cast<char>(0x80 | (code >> 6 & 0x3F)),
          static_cast<char>(0x80 | (code & 0x3F))};
}

Colour colour_of(const std::string& quality) {
  if (quality == "good") return Colour::kGood;
  for (const char* reason : {"no_data", "rate_invalid", "input_missing", "over_limit", "implausible"}) {
    if (quality.find(reason) != std::string::npos) return Colour::kBad;
  }
  return Colour::kWarning;
}

// As `prismctl status`; the first line of an axis has the colour of its quality.
std::vector<Line> value_lines(const json& status) {
  std::vector<Line> lines;
  std::istringstream text(values_view(status));
  auto axis = at(status, "axes").begin();
  for (std::string line; std::getline(text, line);) {
    const bool is_first = line.starts_with("quality ") || line.starts_with("axis ");
    lines.push_back({line, is_first ? colour_of(text_of(at(*axis++, "quality"))) : Colour::kPlain});
  }
  return lines;
}

}  // namespace

void Trace::push(const json& row) {
  constexpr double kDayS = 86400;
  const double time_s = number_member(row, "time_s", NAN);
  if (!std::isfinite(time_s)) return;
  while (!points_.empty() && points_.back().time_s >= time_s) points_.pop_back();
  while (!points_.empty() && points_.front().time_s < time_s - kDayS) points_.pop_front();
  if (text_of(at(row, "quality")).find("warming") != std::string::npos) return;
  points_.push_back(
      {time_s, number_member(row, "mean_rate_deg_per_h", NAN), number_member(row, "corrected_mean_deg_per_h", NAN)});
}

std::vector<std::string> Trace::lines(const std::string& name, double end_s, double span_s, int columns,
                                      int rows) const {
  constexpr int kDotColumns = 2, kDotRows = 4;
  constexpr unsigned kBits[kDotColumns][kDotRows] = {{0x01, 0x02, 0x04, 0x40}, {0x08, 0x10, 0x20, 0x80}};
  constexpr double kLeastSpan = 2e-5;   // resolution of the scale's digits
  constexpr double kLeastWidthS = 2.5;  // a row is a second: a shorter column shows the values around it
  const auto before = [](const Point& point, double time_s) { return point.time_s < time_s; };
  const auto first = std::lower_bound(points_.begin(), points_.end(), end_s - span_s, before);
  const bool corrected = std::any_of(first, points_.end(), [](const auto& p) { return std::isfinite(p.corrected); });
  double Point::*const value = corrected ? &Point::corrected : &Point::rate;
  double low = NAN, high = NAN;
  for (auto point = first; point != points_.end(); ++point)
    low = std::fmin(low, (*point).*value), high = std::fmax(high, (*point).*value);
  const double half = std::max(high - low, kLeastSpan) / 2, top = (low + high) / 2 + half;
  const std::size_t width = static_cast<std::size_t>(columns - kLeftColumns),
                    last_row = static_cast<std::size_t>(rows - 1);
  std::vector<unsigned> dots(width * (last_row + 1));
  const double step_s = span_s / static_cast<double>(width * kDotColumns),
               around_s = std::max(step_s, kLeastWidthS) / 2;
  for (std::size_t i = 0; i < width * kDotColumns; ++i) {
    const double middle_s = end_s - span_s + (static_cast<double>(i) + 0.5) * step_s;
    double sum = 0, count = 0;
    for (auto point = std::lower_bound(first, points_.end(), middle_s - around_s, before);
         point != points_.end() && point->time_s < middle_s + around_s; ++point) {
      if (std::isfinite((*point).*value)) sum += (*point).*value, ++count;
    }
    if (count == 0) continue;  // a gap
    const double last_dot = static_cast<double>(rows * kDotRows - 1);
    const auto dot =
        static_cast<std::size_t>(std::lround(std::clamp((top - sum / count) / (2 * half) * last_dot, 0.0, last_dot)));
    dots[dot / kDotRows * width + i / kDotColumns] |= kBits[i % kDotColumns][dot % kDotRows];
  }
  std::vector<std::string> lines;
  for (std::size_t row = 0; row <= last_row; ++row) {
    const char* const quantity = row < last_row ? "" : corrected ? "corrected" : "raw rate";
    const bool named = std::isfinite(low) && (row == 0 || row == last_row);
    lines.push_back(fmt::format("{:<{}}{:>{}} │", row == 0 ? utf8_prefix(name, kNameColumns) : quantity, kNameColumns,
                                named ? scale_text(row == 0 ? top : top - 2 * half) : "", kScaleColumns));
    for (std::size_t column = 0; column < width; ++column) lines.back() += braille(dots[row * width + column]);
  }
  return lines;
}

void Screen::status(json status, double steady_s) {
  status_ = std::move(status);
  status_steady_s_ = steady_s;
  instance_ = text_of(at(status_, "name"), instance_);
  gone_.clear();
  for (const auto& [axis, own] : at(status_, "axes").items()) {
    if (follows(TextRule::kAxisName, axis)) traces_[axis];
  }
}

void Screen::row(const json& row) {
  const auto trace = traces_.find(text_of(at(row, "axis")));
  if (trace == traces_.end() || !at(row, "time_s").is_number()) return;
  trace->second.push(row);
  row_time_s_ = at(row, "time_s").get<double>();
}

void Screen::event(const json& event) {
  constexpr std::size_t kKept = 16;
  const bool alarming = at(event, "severity") == "error" || at(event, "severity") == "warning";
  std::string text = event_line(event);
  text.pop_back();  // the line end
  events_.push_back({text, alarming ? Colour::kWarning : Colour::kPlain});
  if (events_.size() > kKept) events_.pop_front();
}

void Screen::key(char key) {
  if (key >= '1' && key <= '5') span_ = static_cast<std::size_t>(key - '1');
}

// The last status; without numbers of axes that have no current ones.
json Screen::current(double steady_s) const {
  json status = status_.is_object() ? status_ : json::object();
  const bool is_current = gone_.empty() && status_.is_object() && steady_s - status_steady_s_ <= kStatusTimeoutS;
  if (!is_current) {
    status["state"] = gone_.empty() ? "prismd does not respond" : "prismd stopped";
    status["detail"] = gone_.empty() ? "no response to status requests" : gone_ + "; retrying";
    if (at(status, "age_s").is_number()) status["age_s"] = number_member(status, "age_s") + steady_s - status_steady_s_;
  }
  for (json& axis : at(status, "axes").is_object() ? status["axes"] : status["axes"] = json::object()) {
    if (!is_current || at(axis, "quality") == "no_data") axis = {{"quality", "no_data"}, {"model", at(axis, "model")}};
  }
  return status;
}

// Of the same height for each axis; below them the time.
std::vector<Line> Screen::traces(int columns, int rows, double now_s) const {
  if (traces_.empty() || columns <= kLeftColumns) return {};
  const int each = std::max((rows - 1) / static_cast<int>(traces_.size()), 2), half = (columns - kLeftColumns) / 2;
  std::vector<Line> lines;
  for (const auto& [axis, trace] : traces_) {
    for (const std::string& line : trace.lines(axis, now_s, kSpans[span_].length_s, columns, each))
      lines.push_back({line, Colour::kCurve});
  }
  const int window_s = window_length_s(at(at(status_, "axes"), traces_.begin()->first));
  lines.push_back(
      {fmt::format("{:<{}}-{:<{}}-{:<{}}now", fmt::format("{} s mean, deg/h", window_s), kLeftColumns,
                   kSpans[span_].name, half, kSpans[span_].half, std::max(columns - kLeftColumns - half - 5, 0)),
       Colour::kFaint});
  return lines;
}

std::vector<Line> Screen::lines(const Size& size, double steady_s, const std::string& utc) const {
  constexpr int kTall = 36;
  const json status = current(steady_s);
  // State and age of the data; below them the reason, or the source.
  const std::string state = text_of(at(status, "state")), why = text_of(at(status, "detail"), "");
  std::string head = fmt::format("{}  {}, {}", instance_, state, age_text(at(status, "age_s")));
  const int gap = size.columns - static_cast<int>(columns_of(head) + columns_of(utc));
  if (gap > 0) head += std::string(static_cast<std::size_t>(gap), ' ') + utc;
  const bool good = state == "receiving" || state == "replaying";
  std::vector<Line> lines = {{head, good ? Colour::kGood : Colour::kBad}};
  const std::string source = text_of(at(status, "device"), "no device") + ", frames " + text_of(at(status, "frames"));
  lines.push_back(why.empty() ? Line{source} : Line{why, Colour::kBad});

  const auto add = [&lines](const auto& more) { lines.insert(lines.end(), more.begin(), more.end()); };
  const auto room = [&] { return size.rows - static_cast<int>(lines.size()) - 1; };
  add(value_lines(status));
  lines.push_back({frame_counts(status_)});
  // The time of the data may differ from this machine's clock: now is the last row's time and the age of the data.
  const double age_s = number_member(status_, "age_s") + steady_s - status_steady_s_;
  add(traces(size.columns, room() - (size.rows >= kTall ? 8 : 3), row_time_s_ + std::max(age_s, 0.0)));
  const auto events = std::min(static_cast<int>(events_.size()), std::max(room(), 0));
  add(std::vector<Line>(events_.end() - events, events_.end()));
  lines.resize(static_cast<std::size_t>(std::max(size.rows - 1, 0)));  // with few rows: the top and the keys
  lines.push_back({fmt::format("q quit   1-5 time span: {}", kSpans[span_].name), Colour::kFaint});
  for (Line& line : lines) line.text = fitted(line.text, static_cast<std::size_t>(size.columns));
  return lines;
}

namespace {

json subscription_of(const WatchSettings& settings) {
  json wanted = {{"streams", {settings.samples ? "sample" : "window", "event"}}, {"every", settings.every}};
  if (!settings.axis.empty()) wanted["axes"] = {settings.axis};
  return wanted;
}

void print_notification(const std::string& method, const json& params, bool as_json, bool several) {
  if (as_json) return print_json(json{{"method", method}, {"params", params}});
  if (method == "event") return print_text("# " + event_line(params));
  if (method == "lost")
    return print_text(fmt::format("# {} rows lost: this client read too slowly\n", count_text(at(params, "rows"))));
  print_text((several ? fmt::format("{:<5}", text_of(at(params, "axis"), "")) : "") + window_line(params));
}

asio::awaitable<Result<void>> watch_lines(client::Client& client, const WatchSettings& settings) {
  const auto status = co_await client.ask("status");  // the heading depends on the number of axes
  if (!status) co_return tl::unexpected<Error>(status.error().error);
  const bool several = settings.axis.empty() && at(*status, "axes").size() > 1;
  if (!settings.json) fmt::print("{}{}", several ? "axis " : "", window_heading());
  const auto executor = co_await asio::this_coro::executor;
  asio::signal_set end(executor, SIGINT, SIGTERM);
  std::uint64_t rows = 0;
  bool done = false;
  client.on_notification = [&](std::string_view line) {
    const json message = parse_json_line(line).value_or(json());
    const std::string method = text_member(message, "method");
    if (done || method.empty()) return;
    print_notification(method, at(message, "params"), settings.json, several);
    if (method == (settings.samples ? "sample" : "window")) ++rows;
    done = std::fflush(stdout) != 0 || (rows > 0 && rows == settings.count);  // or the reader closed the pipe
    if (done) end.cancel();
  };
  const auto subscribed = co_await client.ask("subscribe", subscription_of(settings));
  if (subscribed && !done) co_await end.async_wait(kUse);
  client.on_notification = nullptr;
  if (!subscribed) co_return tl::unexpected<Error>(subscribed.error().error);
  co_return Result<void>();
}

bool is_set(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr && *value != '\0';
}

Size terminal_size() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) return {};
  return {size.ws_col, size.ws_row};
}

// Plain VT sequences, which all current terminals, multiplexers and the Linux console support.
void print_screen(const std::vector<Line>& lines) {
  constexpr std::array<const char*, 6> kColours = {"", "\033[2m", "\033[32m", "\033[33m", "\033[1;31m", "\033[36m"};
  const bool colour = !is_set("NO_COLOR");  // https://no-color.org
  std::string text = "\033[H";
  for (const Line& line : lines)
    text += (colour ? kColours[static_cast<std::size_t>(line.colour)] : "") + line.text + "\033[0m\033[K\r\n";
  text.resize(text.size() - 2);
  fmt::print("{}\033[J", text);
  std::fflush(stdout);
}

double steady_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Keys are read without a line end and not shown; Ctrl-C and Ctrl-Z stay signals. Returns what restores them; null if
// standard input is not a terminal.
std::shared_ptr<termios> read_keys() {
  termios before{};
  if (::tcgetattr(STDIN_FILENO, &before) != 0) return nullptr;
  termios keys = before;
  keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  keys.c_cc[VMIN] = keys.c_cc[VTIME] = 0;
  ::tcsetattr(STDIN_FILENO, TCSANOW, &keys);
  return {new termios(before), [](termios* old) {
            ::tcsetattr(STDIN_FILENO, TCSANOW, old);
            delete old;
          }};
}

// The live screen. After the end the last values remain on the terminal.
Result<void> watch_screen(const std::string& socket, const WatchSettings& settings) {
  asio::io_context io;
  client::Client client(io, socket);
  Screen screen(client.name());
  Result<void> result;
  client.on_notification = [&](std::string_view line) {
    const json message = parse_json_line(line).value_or(json());
    if (at(message, "method") == "window") screen.row(at(message, "params"));
    if (at(message, "method") == "event") screen.event(at(message, "params"));
  };
  client.on_end = [&](client::State, const std::string& reason) { screen.gone(Error{socket, reason}.text()); };
  // The status each second, first also the rows of the last hour and the last events.
  const client::Client::Session ask = [&]() -> asio::awaitable<std::string> {
    asio::steady_timer second(io);
    for (bool first = true;; first = false) {
      second.expires_after(std::chrono::seconds(1));
      auto status = co_await client.ask("status");
      if (!status) co_return status.error().error.what;
      result = choose_axis(*status, settings.axis);
      if (!result) io.stop();
      screen.status(std::move(*status), steady_s());
      if (first) {
        co_await client.ask("subscribe", subscription_of(settings));
        json wanted = {{"seconds", 3600}};
        const auto history = co_await client.ask("history", wanted);
        for (const json& axis : history ? at(*history, "axes") : json()) {
          for (const json& row : axis) screen.row(row);
        }
        wanted = {{"count", 16}};
        const auto events = co_await client.ask("events", wanted);
        for (const json& event : events ? *events : json()) screen.event(event);
      }
      co_await second.async_wait(kUse);
    }
  };
  const std::shared_ptr<termios> keys = read_keys();
  // Each second, and after a key.
  const auto draw = [&]() -> asio::awaitable<void> {
    constexpr int kTicks = 10;
    asio::steady_timer tick(io);
    for (int ticks = 0;; ++ticks) {
      char key = '\0';
      if (keys && ::read(STDIN_FILENO, &key, 1) != 1) key = '\0';
      if (key == 'q') co_return io.stop();
      screen.key(key);
      if (key != '\0' || ticks % kTicks == 0) {
        const std::string utc = utc_text(host_time_ns() / 1'000'000'000).substr(11, 8) + " UTC";
        print_screen(screen.lines(terminal_size(), steady_s(), utc));
      }
      tick.expires_after(std::chrono::milliseconds(1000 / kTicks));
      co_await tick.async_wait(kUse);
    }
  };
  asio::co_spawn(io, client.run(ask, true), asio::detached);
  asio::co_spawn(io, draw(), asio::detached);
  asio::signal_set signals(io, SIGINT, SIGTERM, SIGHUP);
  signals.async_wait([&](boost::system::error_code, int) { io.stop(); });
  io.run();
  fmt::print("\n");
  return result;
}

}  // namespace

int watch(const std::string& socket, const WatchSettings& settings) {
  ::signal(SIGPIPE, SIG_IGN);
  const bool terminal =
      ::isatty(STDOUT_FILENO) != 0 && is_set("TERM") && std::string_view(std::getenv("TERM")) != "dumb";
  const client::Work lines = [&](client::Client& client) { return watch_lines(client, settings); };
  const auto done = terminal && !settings.json && !settings.samples && settings.count == 0
                        ? watch_screen(socket, settings)
                        : client::connected(socket, lines);
  return done ? 0 : fail(done.error());
}

}  // namespace prism::prismctl
