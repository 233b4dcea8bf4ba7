// SPDX-License-Identifier: MIT
#include "daemon/line/live_line.hpp"

#include <fmt/format.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <cstdlib>
#include <utility>

#include "base/escape.hpp"
#include "base/host_time.hpp"
#include "base/time_scale.hpp"
#include "daemon/awaiting.hpp"
#include "drivers/transport/serial_line.hpp"

namespace prism::line {
namespace {

namespace asio = boost::asio;
using daemon::kUse;
using pipeline::LineState, pipeline::Severity;

constexpr std::int64_t kFollowNs = 500'000'000;

constexpr std::chrono::seconds kForget{60};  // without another host that is turned away

constexpr std::size_t kMostUnsent = 64 << 10;
constexpr std::chrono::milliseconds kRetryWrite{10};

constexpr std::uint8_t kFf = 0xFF;  // begins a command of Telnet

auto as_steady(std::chrono::duration<double> seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(seconds);
}

}  // namespace

void ArrivalClock::begin() {
  offset_ns_ = host_time_ns() - std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  last_ns_ = 0;
}

std::int64_t ArrivalClock::check() {
  ArrivalClock now;
  const std::int64_t step = now.offset_ns_ - offset_ns_;
  if (std::abs(step) <= kFollowNs) return 0;
  *this = now;
  return step;
}

LiveLine::LiveLine(asio::io_context& io, pipeline::Device& device, std::size_t number, ArrivalClock& clock, bool alone,
                   pipeline::Tell tell)
    : io_(io),
      device_(device),
      number_(number),
      tell_(std::move(tell)),
      watch_timer_(io),
      pause_timer_(io),
      command_timer_(io),
      arrival_(clock),
      alone_(alone),
      last_progress_(Clock::now()),
      fault_key_(fmt::format("line {}", number)),
      peer_key_(fmt::format("peer {}", number)) {}

void LiveLine::start() {
  asio::co_spawn(io_, watch(), asio::detached);
  retry_.reset();
  open();
}

void LiveLine::begin_stop() {
  stopping_ = true;
  if (!is_open()) return;
  const wire::Commands& commands = device_.setup.line_commands(number_);
  open_->steps.reset();
  if (!commands.stop || commands.stop->empty()) return;
  open_->steps.emplace(*commands.stop);
  converse();
}

Result<void> LiveLine::send(std::span<const std::uint8_t> bytes) {
  const std::string name = transport::describe(settings());
  if (!config().allow_send)
    return make_error(name, "the configuration does not allow it; expected \"allow_send\": true");
  if (!is_open()) return make_error(name, "is not open: " + status().detail);
  if (const auto sent = put(bytes); !sent) return make_error("send", sent.error().what);
  if (!open_->unsent.empty()) converse();
  tell(Severity::kInfo, "sent", fmt::format("{}: sent {}", name, drivers::bytes_text(bytes)));
  return {};
}

void LiveLine::stop() {
  stopping_ = true;
  open_.reset();
  watch_timer_.cancel();
  pause_timer_.cancel();
  command_timer_.cancel();
}

void LiveLine::reopen() {
  pause_timer_.cancel();
  open_.reset();
  open();
}

void LiveLine::open() {
  auto opened = transport::open(io_, settings());
  if (!opened) return not_opened(opened.error().text());
  open_ = Open{std::move(*opened), false, {}, {}};  // clang 14 takes Open for not default-constructible here
  begun_ = false;
  proceed({});
}

void LiveLine::not_opened(const std::string& why) {
  set(LineState::kConnecting, why);
  complain("line_absent", why + "; retrying");
  open_.reset();
  pause();
}

void LiveLine::opened() {
  if (alone_) arrival_.begin();
  opened_at_ = last_data_ = last_progress_ = Clock::now();
  framed_ = false;
  heard_.clear();
  telnet_.reset();
  if (settings().network.type == "tcp") telnet_ = ff_run_ = 0;
  resyncs_ = device_.decoded(number_).resyncs;
  status().notes = open_->transport->notes();
  status().hardware.reset();
  const std::string kind = fault_kind();
  const bool known = kind == "line_silent" || kind == "line_start_up";
  if (!known && !continues_fault()) {  // else logged once, even if the line is reopened
    set(LineState::kConnecting, "open, no data yet");
    tell(Severity::kInfo, "line_open", transport::describe(settings()) + ": open");
    for (const std::string& note : status().notes) tell(Severity::kInfo, "line_note", note);
  }
  last_frame_ = last_data_;
  frames_ = device_.decoded(number_).frames;
  const auto& poll = device_.setup.line_commands(number_).poll;
  if (!poll) {
    poller_.reset();
  } else if (!poller_ || poller_->poll() != *poll) {
    poller_.emplace(*poll);
  }
  ++openings_;
  open_->is_ready = true;
  start_device();
}

// Commands. Each of these functions is the last in its caller: one that fails at once closes the line.

// The line is open, or its device must be started again.
void LiveLine::start_device() {
  const auto& start = device_.setup.line_commands(number_).start;
  if (start && !start->empty()) {
    open_->steps.emplace(*start);
    return converse();
  }
  started();
}

// All start-up commands were answered.
void LiveLine::started() {
  if (begun_ && fault_kind() != "line_silent") receiving();
  if (!poller_) return;
  poller_->begin(Clock::now());
  converse();
}

void LiveLine::answered(std::span<const std::uint8_t> bytes, std::uint64_t frames) {
  if (open_->steps) {
    open_->steps->received(bytes);
  } else if (polls() && frames > 0) {
    poller_->replied(Clock::now());
  } else {
    return;
  }
  converse();
}

void LiveLine::converse() {
  const Clock::time_point now = Clock::now();
  if (const auto sent = put({}); !sent) return lose("line_lost", sent.error().what);
  if (!open_->unsent.empty()) return converse_at(now + kRetryWrite);
  if (open_->steps) return converse_by_steps(now);
  if (!polls()) return;
  if (const auto request = poller_->proceed(now); !request.empty()) {
    if (const auto sent = put(request); !sent) return lose("line_lost", sent.error().what);
  }
  converse_at(poller_->deadline());
}

void LiveLine::converse_by_steps(Clock::time_point now) {
  drivers::StartUp& steps = *open_->steps;
  for (auto bytes = steps.proceed(now); !bytes.empty(); bytes = steps.proceed(now)) {
    if (const auto sent = put(bytes); !sent) return lose("line_lost", sent.error().what);
  }
  if (steps.has_failed()) {
    const std::string why = "start-up: " + steps.text();
    open_->steps.reset();
    return stopping_ ? void() : lose("line_start_up", why);
  }
  if (!steps.is_done()) {
    if (!stopping_ && fault_kind().empty()) set(LineState::kConnecting, "start-up: " + steps.text());
    return converse_at(steps.deadline());
  }
  open_->steps.reset();
  if (!stopping_) started();
}

// Sends what the line takes now.
Result<void> LiveLine::put(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint8_t>& unsent = open_->unsent;
  if (unsent.size() + bytes.size() > kMostUnsent)
    return make_error(transport::describe(settings()), "the device does not take the bytes that are sent");
  unsent.insert(unsent.end(), bytes.begin(), bytes.end());
  if (unsent.empty()) return {};
  const Result<std::size_t> taken = open_->transport->write(unsent);
  if (!taken) {
    unsent.clear();
    return tl::unexpected<Error>(taken.error());
  }
  if (const auto& capture = status().capture; capture && *taken > 0)
    capture->record(drivers::CaptureEvent::kSent, {unsent.data(), *taken}, arrival_.stamp(Clock::now()));
  unsent.erase(unsent.begin(), unsent.begin() + static_cast<std::ptrdiff_t>(*taken));
  return {};
}

void LiveLine::converse_at(Clock::time_point when) {
  command_timer_.expires_at(when);
  command_timer_.async_wait([this, opening = openings_](boost::system::error_code error) {
    if (!error && opening == openings_ && is_open()) converse();
  });
}

std::string LiveLine::prefix() const {
  return number_ == pipeline::kGyroLine ? "" : device_.setup.sensor_lines[number_ - 1].name + ": ";
}

void LiveLine::tell(Severity severity, const char* kind, const std::string& text) {
  tell_(severity, kind, prefix() + text);
}

void LiveLine::set(LineState state, const std::string& detail) { status().set(state, detail, host_time_ns()); }

// Logs a fault once; again only if it changes, or after data arrived. A connection that was lost, then refused, is one
// fault.
void LiveLine::complain(const std::string& kind, const std::string& text) {
  const Problem before = device_.problems.find(fault_key_);
  const bool same = before.kind == "line_start_up" && before.kind == kind;
  if (same || continues_fault() || before.text == prefix() + text) return;
  device_.problems.forget(fault_key_);  // another fault is reported
  device_.problems.set(fault_key_, {.kind = kind, .text = prefix() + text});
}

// Asio only waits until the line is readable: read(2), called directly, costs less.
void LiveLine::listen() {
  open_->transport->wait([this, number = ++waits_](const boost::system::error_code& error) {
    if (!error && number == waits_ && open_) readable();
  });
}

void LiveLine::readable() {
  using Kind = transport::Received::Kind;
  const transport::Received received = open_->transport->read(buffer_);
  if (!open_->is_ready) return proceed(received);
  if (received.kind == Kind::kLost) return lose("line_lost", received.why + heard_instead());
  if (received.kind == Kind::kEmpty) return rest();
  if (received.kind == Kind::kData) {
    last_data_ = last_progress_ = Clock::now();
    const std::int64_t arrival_ns = arrival_.stamp(last_data_);
    const std::span<const std::uint8_t> bytes(buffer_.data(), received.bytes);
    if (!begun_) begin_receiving(arrival_ns);
    device_.feed(number_, bytes, arrival_ns);
    const std::uint64_t frames = device_.decoded(number_).frames;
    const std::uint64_t complete = frames > frames_ ? frames - frames_ : 0;
    frames_ = frames;
    if (!framed_) remember(bytes);
    if (telnet_) watch_doubled(bytes);
    if (complete > 0) frames_came();
    listen();
    return answered(bytes, complete);
  }
  listen();
}

// A line that opens in steps.
void LiveLine::proceed(const transport::Received& received) {
  if (received.kind == transport::Received::Kind::kLost)
    return not_opened(transport::describe(settings()) + ": " + received.why);
  listen();
  if (const std::string step = open_->transport->opening(); step.empty()) {
    opened();
  } else if (fault_kind().empty()) {
    set(LineState::kConnecting, step);
  }
}

void LiveLine::begin_receiving(std::int64_t arrival_ns) {
  begun_ = true;
  device_.begin_session(number_, arrival_ns);
  if (!is_starting()) receiving();
}

// Data come, and the start-up commands, if any, were answered.
void LiveLine::receiving() {
  set(LineState::kReceiving);
  tell(Severity::kInfo, "line_receiving", transport::describe(settings()) + ": receiving");
  device_.problems.forget(fault_key_);
}

void LiveLine::lose(const std::string& kind, const std::string& why, LineState state) {
  set(state, why);
  complain(kind, fmt::format("{}: {}{}; opening it again until data comes", transport::describe(settings()),
                             kind == "line_lost" ? "lost: " : "", why));
  open_.reset();
  device_.finish(number_);
  pause();
}

// Reports new hardware errors as an event.
void LiveLine::count_hardware() {
  const auto counters = open_->transport->counters();
  std::optional<transport::LineCounters>& before = status().hardware;
  if (counters && before && counters->errors() > before->errors()) {
    tell(Severity::kWarning, "line_errors",
         "the serial hardware reports errors on the line; prismctl line counts them");
  }
  before = counters;
}

// Wakes at most once a second, not per read: checks for missing data, expires frame candidates, reads hardware
// counters.
asio::awaitable<void> LiveLine::watch() {
  while (!stopping_) {
    const auto silence = as_steady(std::chrono::duration<double>(config().silence_s));
    const auto due = is_open() ? last_data_ + silence : Clock::now() + silence;
    const auto next =
        std::clamp(due, Clock::now() + std::chrono::milliseconds(10), Clock::now() + std::chrono::seconds(1));
    watch_timer_.expires_at(next);
    co_await watch_timer_.async_wait(kUse);
    if (poller_) status().polls = poller_->counters();
    if (stopping_ || !open_ || watch_peers(silence)) continue;
    if (!open_->is_ready) {  // a step may take seconds, and a peer may come at any time
      last_progress_ = Clock::now();
      continue;
    }
    device_.expire(number_, arrival_.now_ns());
    count_hardware();
    if (is_starting()) last_data_ = last_progress_ = Clock::now();  // it has its own time limits
    watch_frames(silence);
    if (!open_) continue;
    // Unread bytes: the line has data, but this process did not run (stopped, swapped out, no CPU time).
    if (Clock::now() - last_data_ < silence || open_->transport->has_unread()) continue;
    std::string why = fmt::format("no data for {} s", config().silence_s);
    if (const std::string others = transport::other_users_of(settings().device); !others.empty())
      why += fmt::format("; another program may be reading this device: {}", others);
    lose("line_silent", why, LineState::kSilent);
  }
}

void LiveLine::frames_came() {
  last_frame_ = last_data_;
  retry_.reset();
  framed_ = true;
  if (status().state != LineState::kReceiving && !is_starting()) receiving();
}

// A device that sends bytes but no frames may have lost its settings.
void LiveLine::watch_frames(Clock::duration silence) {
  const Clock::time_point now = Clock::now();
  const wire::Commands& commands = device_.setup.line_commands(number_);
  const bool again = commands.again_when_silent.value_or(false) && commands.start && !commands.start->empty();
  if (!again || is_starting() || now - last_frame_ < silence || now - last_data_ >= silence) return;
  last_frame_ = now;
  const std::string why = fmt::format("no frame for {} s; sending the start-up commands again", config().silence_s);
  set(LineState::kConnecting, why);  // until a frame comes
  complain("line_silent", transport::describe(settings()) + ": " + why);
  start_device();
}

// A line that listens has one peer. If no frame came from it, it is replaced by another host that connects. Returns
// true if it did.
bool LiveLine::watch_peers(Clock::duration silence) {
  const Clock::time_point now = Clock::now();
  const std::string other = open_->transport->turn_away(), peer = open_->transport->peer();
  if (!other.empty() && is_open() && !framed_ && now - opened_at_ >= silence) {
    lose("line_lost", fmt::format("{} sent no frame for {} s and is replaced by {}{}", peer, config().silence_s, other,
                                  heard_instead()));
    return true;
  }
  if (!other.empty()) turned_away_at_ = now;
  const std::string place = prefix() + transport::describe(settings()) + ": ";
  if (!other.empty()) {
    const std::string why =
        peer.empty() ? fmt::format("only {} may connect", settings().network.from) : peer + " is connected";
    device_.problems.set(peer_key_,
                         {.kind = "line_peer", .text = fmt::format("{}{} is turned away: {}", place, other, why)});
  } else if (now - turned_away_at_ >= scaled(kForget)) {
    device_.problems.clear(peer_key_, place + "no other host connects now");
  }
  return false;
}

// A text or a Telnet server may answer where a gyro is expected.
void LiveLine::remember(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kShown = 60;
  constexpr std::uint8_t kFirstRequest = 0xFB;
  const bool first = heard_.empty();
  heard_.append(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kShown - heard_.size()));
  if (!first || bytes.size() < 3 || bytes[0] != kFf || bytes[1] < kFirstRequest || bytes[1] == kFf) return;
  suspect_telnet(fmt::format("the other end speaks Telnet (FF {:02X} {:02X})", bytes[1], bytes[2]));
}

// A Telnet server sends each byte FF twice, which damages the frames that contain one.
void LiveLine::watch_doubled(std::span<const std::uint8_t> bytes) {
  constexpr std::uint64_t kEnough = 10;
  for (const std::uint8_t byte : bytes) {
    if (byte == kFf) {
      ++ff_run_;
    } else if (const std::size_t run = std::exchange(ff_run_, 0); run % 2 == 1) {
      return telnet_.reset();
    } else if (run > 0) {
      ++*telnet_;
    }
  }
  if (const std::uint64_t damaged = device_.decoded(number_).resyncs;  // starts at 0 again after a reload
      *telnet_ >= kEnough && 2 * damaged >= 2 * resyncs_ + *telnet_)
    suspect_telnet(fmt::format(
        "each byte FF came twice, {} times, and frames with it are damaged: the other end speaks Telnet", *telnet_));
}

void LiveLine::suspect_telnet(const std::string& why) {
  if (!telnet_) return;
  telnet_.reset();
  status().notes.push_back(why + ": set the port of the device server to raw TCP, else a byte FF comes twice");
  tell(Severity::kWarning, "line_note", status().notes.back());
}

std::string LiveLine::heard_instead() const {
  if (framed_ || heard_.empty()) return {};
  const std::size_t end = heard_.find_last_not_of("\r\n") + 1;
  return fmt::format("; no frame came, but \"{}\"", printable(std::string_view(heard_).substr(0, end)));
}

// A line can be readable without data: without this pause it would be read in a busy loop.
void LiveLine::rest() {
  pause_timer_.expires_after(std::chrono::milliseconds(20));
  pause_timer_.async_wait([this, number = waits_](boost::system::error_code error) {
    if (!error && number == waits_ && open_) listen();
  });
}

void LiveLine::pause() {
  const auto wait = retry_.next(config(), transport::is_present(settings()));
  last_progress_ = Clock::now() + wait;
  pause_timer_.expires_after(wait);
  pause_timer_.async_wait([this](boost::system::error_code error) {
    if (!error && !stopping_ && !open_) open();
  });
}

}  // namespace prism::line
