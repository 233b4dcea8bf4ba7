// SPDX-License-Identifier: MIT
// Lines as scripts, with the test as the device: the events and bytes of a live line, and the bytes of an output.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <regex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "daemon/line/live_line.hpp"
#include "daemon/line/output_line.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/emulated.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::line {
namespace {

using boost::asio::ip::tcp;
using test::next;
using test::rest_of;
using Lines = std::vector<std::string>;

constexpr std::array kStates = {"none", "connecting", "receiving", "silent", "replaying", "ended"};

/// The bytes that a line stores: received and sent.
struct CountedCapture : pipeline::CaptureSink {
  void record(drivers::CaptureEvent event, std::span<const std::uint8_t> bytes, std::int64_t) override {
    opened += event == drivers::CaptureEvent::kOpened;
    (event == drivers::CaptureEvent::kSent ? written : received) += bytes.size();
  }
  void flush() override {}
  std::uint64_t dropped_bytes() const override { return 0; }
  std::size_t opened = 0, received = 0, written = 0;
};

/// The far end of a line: a TCP port that is listened to, a connection to one, or a terminal.
class FarEnd {
 public:
  explicit FarEnd(boost::asio::io_context& io) : io_(io), acceptor_(io, tcp::endpoint(loopback(), 0)), peer_(io) {
    port_ = acceptor_.local_endpoint().port();
    acceptor_.non_blocking(true);
  }
  int port() const { return port_; }
  void refuse() { acceptor_.close(); }
  void listen() {
    if (acceptor_.is_open()) return;
    acceptor_.open(tcp::v4());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind({loopback(), port_});
    acceptor_.listen();
    acceptor_.non_blocking(true);
  }
  bool accept() {
    boost::system::error_code error;
    if (peer_.is_open()) peer_.close();
    acceptor_.accept(peer_, error);
    return !error;
  }
  bool connect() {
    boost::system::error_code error;
    peer_ = tcp::socket(io_);
    peer_.connect({loopback(), port_}, error);
    return !error;
  }
  /// Another host that connects to the same port.
  void connect_other() { tcp::socket(io_).connect({loopback(), port_}); }
  void open_terminal(const std::string& link) {
    int main = -1, other = -1;
    ASSERT_EQ(::openpty(&main, &other, nullptr, nullptr, nullptr), 0);
    ::fcntl(main, F_SETFL, O_NONBLOCK);
    std::array<char, 64> name{};
    ASSERT_EQ(::ttyname_r(other, name.data(), name.size()), 0);
    main_.reset(main), other_.reset(other);
    std::filesystem::remove(link);
    std::filesystem::create_symlink(name.data(), link);
  }
  void close() {
    main_.reset(), other_.reset();
    boost::system::error_code ignored;
    peer_.close(ignored);
  }
  void write(const std::string& bytes) {
    ASSERT_EQ(::write(fd(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  std::string read(std::size_t most = 1 << 20) {
    std::string text(most, ' ');
    const ssize_t size =
        main_.get() >= 0 ? ::read(fd(), text.data(), most) : ::recv(fd(), text.data(), most, MSG_DONTWAIT);
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return text;
  }

 private:
  static boost::asio::ip::address_v4 loopback() { return boost::asio::ip::address_v4::loopback(); }
  int fd() { return main_.get() >= 0 ? main_.get() : peer_.native_handle(); }

  boost::asio::io_context& io_;
  tcp::acceptor acceptor_;
  tcp::socket peer_;
  Descriptor main_, other_;
  std::uint16_t port_ = 0;
};

/// A device with a gyro of trplg or of lines of text and, if a script needs it, a sensor line or an output. PORT is the
/// far end's, TTY the path of its terminal. Each command gives the events so far.
class LinesPlayer {
 public:
  virtual ~LinesPlayer() = default;

 protected:
  /// Writes the configuration and loads it.
  pipeline::Setup load(const std::string& members) {
    std::string text = fmt::format(
        R"({{"name": "gyro", "frames": "{}/config/frames/trplg.json", "clock": "device", "socket": {{"path": ""}}, {}}})",
        PRISM_SOURCE_DIR, members);
    text = std::regex_replace(text, std::regex("PORT"), std::to_string(far_.port()));
    std::ofstream(folder_.file("gyro.json")) << std::regex_replace(text, std::regex("TTY"), tty());
    auto setup = pipeline::load_setup(folder_.file("gyro.json"));
    if (!setup) throw std::runtime_error(setup.error().text());
    return *setup;
  }
  void make(const pipeline::Setup& setup) {
    std::vector<std::unique_ptr<pipeline::CaptureSink>> captures;
    for (std::size_t i = 0; i <= setup.sensor_lines.size(); ++i) {
      auto capture = std::make_unique<CountedCapture>();
      captures_.push_back(capture.get());
      captures.push_back(std::move(capture));
    }
    device_.emplace(
        setup, std::vector<std::unique_ptr<pipeline::RowWriter>>(), std::move(captures), [](const pipeline::Rows&) {},
        tell_, problems_);
  }
  /// Runs until this is true, or a generous limit is over.
  bool comes(const std::function<bool()>& what) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!what()) {
      if (std::chrono::steady_clock::now() >= end) return false;
      turn();
    }
    return true;
  }
  void turn() {
    io_.restart();
    io_.run_for(std::chrono::milliseconds(1));
  }
  Lines given(bool good = true) {
    Lines events = std::exchange(events_, {});
    if (!good) events.emplace_back("does not come");
    return events;
  }
  std::string tty() const { return folder_.file("tty"); }
  std::string plain(std::string text) const {
    text = std::regex_replace(text, std::regex(":" + std::to_string(far_.port())), ":PORT");
    return std::regex_replace(text, std::regex(tty()), "TTY");
  }
  bool has(const std::string& kind) const {
    return std::any_of(events_.begin(), events_.end(),
                       [&](const std::string& event) { return event.find(" " + kind + ":") != std::string::npos; });
  }

  test::TemporaryFolder folder_;
  boost::asio::io_context io_;
  FarEnd far_{io_};
  Lines events_;
  pipeline::Tell tell_ = [this](pipeline::Severity severity, const std::string& kind, const std::string& text) {
    constexpr std::array kNames = {"debug", "info", "warning", "error"};
    events_.push_back(fmt::format("{} {}: {:.200}", kNames.at(static_cast<std::size_t>(severity)), kind, plain(text)));
  };
  Problems problems_{pipeline::problems_as_events(tell_)};
  std::vector<CountedCapture*> captures_;
  std::optional<pipeline::Device> device_;
};

class LiveLinePlayer : public LinesPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "gyro") {  // MEMBERS of its line
      make(load(R"("line": {)" + rest_of(words) + "}"));
      line_.emplace(io_, *device_, number_, clock_, true, tell_);
    } else if (command == "sensors") {  // MEMBERS of a sensor line "room" with one column
      make(load(
          R"("line": {"device": "/dev/null"}, "axes": {"z": {}}, "sensor_lines": {"room": {"columns": {"t": {"column": 1, "unit": "degC"}}, )" +
          rest_of(words) + "}}"));
      line_.emplace(io_, *device_, number_ = 1, clock_, false, tell_);
    } else if (command == "start") {
      line_->start();
    } else if (command == "begin_stop") {
      line_->begin_stop();
      events_.emplace_back(line_->is_stopping() ? "stopping" : "not stopping");
    } else if (command == "stopped") {
      return given(comes([&] { return !line_->is_stopping(); }));
    } else if (command == "stop") {
      line_->stop();
      events_.emplace_back(line_->is_open() ? "open" : "closed");
      io_.restart();
      io_.run();
    } else if (command == "reopen") {
      line_->reopen();
    } else if (command == "refuse") {
      far_.refuse();
    } else if (command == "listen") {
      far_.listen();
    } else if (command == "accept") {
      return given(comes([&] { return far_.accept(); }) && comes([&] { return line_->is_open(); }));
    } else if (command == "connect") {
      return given(comes([&] { return far_.connect(); }) && comes([&] { return line_->is_open(); }));
    } else if (command == "connect_other") {
      far_.connect_other();
    } else if (command == "pass_ms") {  // time, in which the line does nothing
      std::this_thread::sleep_for(std::chrono::milliseconds(next<int>(words)));
    } else if (command == "plug") {
      far_.open_terminal(tty());
      if (device_->lines[number_].state != pipeline::LineState::kNone)
        return given(comes([&] { return line_->is_open(); }));
    } else if (command == "unplug") {
      std::filesystem::remove(tty());
      far_.close();
    } else if (command == "close") {
      far_.close();
    } else if (command == "until") {  // KIND
      const auto kind = next<std::string>(words);
      return given(comes([&] { return has(kind); }));
    } else if (command == "until_state") {  // NAME
      const auto name = next<std::string>(words);
      return given(comes([&] { return kStates[static_cast<std::size_t>(status().state)] == name; }));
    } else if (command == "until_detail") {  // TEXT in the detail of the state
      const std::string text = rest_of(words);
      return given(comes([&] { return status().detail.find(text) != std::string::npos; }));
    } else if (command == "noise_until") {  // KIND of an event
      const auto kind = next<std::string>(words);
      return given(comes([&] {
        far_.write("noise");
        return has(kind);
      }));
    } else if (command == "frames") {  // N; or N "doubled", with bytes FF twice, and a good one after each
      const auto count = next<int>(words);
      const bool doubled = !next<std::string>(words).empty();
      std::vector<std::uint8_t> bytes;
      for (int i = 0; i < count; ++i) {
        std::vector<std::uint8_t> frame;
        encoder_.encode({{10.0}, 0.005, 25.0, 1.5, {}, doubled ? 0xFF00U : 0U}, frame);
        for (const std::uint8_t byte : frame) bytes.insert(bytes.end(), byte == 0xFF && doubled ? 2 : 1, byte);
        if (doubled) encoder_.encode({{10.0}, 0.005, 25.0, 1.5}, bytes);
      }
      return received({bytes.begin(), bytes.end()});
    } else if (command == "bytes") {  // TEXT with \xHH
      return received(bytes_of(words));
    } else if (command == "receives") {  // N bytes at the far end
      const auto size = next<std::size_t>(words);
      std::string text;
      const bool good = comes([&] { return (text += far_.read(size - text.size())).size() >= size; });
      events_.push_back(fmt::format("> {:.60}", printable(text)));
      return given(good);
    } else if (command == "send") {
      const auto sent = line_->send(spans(sent_ = bytes_of(words)));
      if (!sent) events_.push_back(plain(sent.error().text()));
    } else if (command == "state") {
      events_.push_back(state());
    } else {
      return {"unknown command"};
    }
    return given();
  }

 private:
  static std::span<const std::uint8_t> spans(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
  }
  static std::string bytes_of(std::istream& words) {
    std::string bytes;
    const std::string text = rest_of(words);
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool escaped = text.compare(i, 2, "\\x") == 0 && i + 3 < text.size();
      bytes += escaped ? static_cast<char>(std::stoi(text.substr(i + 2, 2), nullptr, 16)) : text[i];
      if (escaped) i += 3;
    }
    return bytes;
  }
  /// The far end writes the bytes; waits until the line has passed them.
  Lines received(const std::string& bytes) {
    const std::uint64_t before = captures_[number_]->received;
    far_.write(bytes);
    return given(comes([&] { return captures_[number_]->received >= before + bytes.size(); }));
  }
  std::string state() {
    std::string text =
        fmt::format("{}{}, {}", line_->is_open() ? "open, " : "", kStates[static_cast<std::size_t>(status().state)],
                    status().detail.empty() ? "-" : plain(status().detail));
    if (status().polls.requests > 0) text += fmt::format(", polls {} missed", status().polls.missed);
    for (const std::string& note : status().notes) text += ", note " + note;
    for (const Problem& problem : problems_.list()) text += ", problem " + problem.kind;
    return text + fmt::format("; {} frames, {} opened, {} sent", device_->decoded(number_).frames,
                              captures_[number_]->opened, captures_[number_]->written);
  }
  const pipeline::LineStatus& status() { return device_->lines[number_]; }

  std::size_t number_ = pipeline::kGyroLine;
  ArrivalClock clock_;
  wire::FrameEncoder encoder_{load(R"("line": {"device": "/dev/null"})").frames};
  std::string sent_;
  std::optional<LiveLine> line_;
};

TEST(LiveLine, Scripts) { test::expect_scripts<LiveLinePlayer>("daemon/live_line.txt"); }

TEST(LiveLine, ScriptsOfATerminal) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  test::expect_scripts<LiveLinePlayer>("daemon/serial_line.txt");
}

/// "send TEXT [AGE_MS]": bytes that leave because of bytes read so long ago.
class OutputLinePlayer : public LinesPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "out") {  // MEMBERS of its line
      auto capture = std::make_unique<CountedCapture>();
      capture_ = capture.get();
      make(load(R"("line": {"device": "/dev/null"}, "out": [{"frames": "prism", "when_unknown": "raw", "line": {)" +
                rest_of(words) + "}}]"));
      device_->output_lines = std::vector<pipeline::OutputStatus>(1);
      line_.emplace(io_, *device_, 0, tell_, std::move(capture));
    } else if (command == "refuse") {
      far_.refuse();
    } else if (command == "accept") {
      return given(comes([&] { return far_.accept(); }) && comes(is_open_));
    } else if (command == "connect") {
      return given(comes([&] { return far_.connect(); }) && comes(is_open_));
    } else if (command == "plug") {
      far_.open_terminal(tty());
      if (line_) return given(comes(is_open_));
    } else if (command == "unplug") {
      std::filesystem::remove(tty());
      far_.close();
      return given(comes([&] { return !is_open_(); }));
    } else if (command == "close") {
      far_.close();
      return given(comes([&] { return !is_open_(); }));
    } else if (command == "send") {
      const auto text = next<std::string>(words);
      send(text, next<int>(words));
    } else if (command == "fill") {  // until bytes wait, also after the kernel has moved what it took first
      const int age_ms = next(words, 0);
      for (int sent = 0, turns = 0; sent < 10'000 && turns < 100; turn()) {
        if (waiting() > 0) {
          ++turns;
        } else {
          send(std::string(1000, '.'), age_ms), ++sent, turns = 0;
        }
      }
      filled_ = status().latencies_s.size();
      events_.emplace_back(waiting() > 0 ? "bytes wait" : "no byte waits");
    } else if (command == "drain") {  // the far end reads all
      return given(comes([&] { return far_.read().empty() && waiting() == 0; }));
    } else if (command == "receives") {
      const auto size = next<std::size_t>(words);
      std::string text;
      const bool good = comes([&] { return (text += far_.read(size - text.size())).size() >= size; });
      events_.push_back(fmt::format("> {:.60}", printable(text)));
      return given(good);
    } else if (command == "tick") {
      for (int ticks = next(words, 1); ticks > 0; --ticks) line_->tick();
    } else if (command == "state") {
      std::string text = fmt::format(
          "{}, {}; {} lost, {} latencies{}", kStates[static_cast<std::size_t>(status().state)],
          status().detail.empty() ? "-" : plain(status().detail), status().lost_bytes,
          status().latencies_s.size() - filled_, status().bytes == sent_ - status().lost_bytes ? "" : ", bytes wait");
      for (const Problem& problem : problems_.list())
        text += fmt::format(", problem {} {}", problem.kind, problem.count);
      events_.push_back(text + fmt::format("; capture {} opened{}", capture_->opened,
                                           capture_->received == status().bytes ? ", all" : ""));
    } else if (command == "end") {
      line_.reset();
      events_.push_back(fmt::format("{} problems", problems_.list().size()));
    } else {
      return {"unknown command"};
    }
    return given();
  }

 private:
  void send(const std::string& text, int age_ms) {
    sent_ += text.size();
    line_->send({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                OutputLine::Clock::now() - std::chrono::milliseconds(age_ms), 1'700'000'000'000'000'000);
  }
  std::uint64_t waiting() { return sent_ - status().lost_bytes - status().bytes; }
  pipeline::OutputStatus& status() { return device_->output_lines.front(); }

  std::function<bool()> is_open_ = [this] { return status().state == pipeline::LineState::kReceiving; };
  CountedCapture* capture_ = nullptr;
  std::uint64_t sent_ = 0;
  std::size_t filled_ = 0;  ///< latencies before the far end took no more bytes
  std::optional<OutputLine> line_;
};

TEST(OutputLine, Scripts) { test::expect_scripts<OutputLinePlayer>("daemon/output_line.txt"); }

TEST(OutputLine, ScriptsOfATerminal) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  test::expect_scripts<OutputLinePlayer>("daemon/serial_output.txt");
}

double seconds(std::chrono::steady_clock::duration time) { return std::chrono::duration<double>(time).count(); }

TEST(RetryPause, DoublesWhileTheDeviceIsThere) {
  config::LineConfig line;
  line.retry_min_s = 0.5, line.retry_max_s = 3;
  RetryPause pause;
  for (const double expected_s : {0.5, 1.0, 2.0, 3.0, 3.0}) EXPECT_EQ(seconds(pause.next(line, true)), expected_s);
  for (const double expected_s : {0.5, 0.5}) EXPECT_EQ(seconds(pause.next(line, false)), expected_s) << "absent";
  for (const double expected_s : {0.5, 1.0}) EXPECT_EQ(seconds(pause.next(line, true)), expected_s) << "back";
  pause.reset();
  for (const double expected_s : {0.5, 1.0}) EXPECT_EQ(seconds(pause.next(line, true)), expected_s) << "after a frame";
}

TEST(ArrivalClock, StampsAreLaterThanTheOnesBefore) {
  ArrivalClock clock;
  const auto now = std::chrono::steady_clock::now();
  const std::int64_t first_ns = clock.stamp(now);
  EXPECT_EQ(first_ns, clock.at(now));
  EXPECT_EQ(clock.stamp(now), first_ns + 1);
  EXPECT_EQ(clock.stamp(now - std::chrono::seconds(1)), first_ns + 2) << "read before, stamped after";
  EXPECT_EQ(clock.stamp(now + std::chrono::seconds(1)), first_ns + 1'000'000'000);
  EXPECT_EQ(clock.check(), 0) << "the host clock was not set";
  EXPECT_EQ(clock.stamp(now), first_ns + 1'000'000'001);
  clock.begin();
  EXPECT_LT(clock.stamp(now), first_ns + 500'000'000) << "another session";
}

}  // namespace
}  // namespace prism::line
