// SPDX-License-Identifier: MIT
// The serial line on a pseudo-terminal: raw, exclusive, reports settings that failed and disconnection.
#include "drivers/transport/serial_line.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/emulated.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::transport {
namespace {

// Both ends of a pty; the slave stays open so that the master is not hung up.
class PseudoTerminal {
 public:
  PseudoTerminal() {
    char name[256] = "";
    if (::openpty(&master_, &slave_, name, nullptr, nullptr) != 0) master_ = slave_ = -1;
    device_ = name;
  }
  ~PseudoTerminal() {
    close_master();
    ::close(slave_);
  }
  void close_master() {
    if (master_ >= 0) ::close(master_);
    master_ = -1;
  }
  int master() const { return master_; }
  const std::string& device() const { return device_; }

 private:
  int master_ = -1, slave_ = -1;
  std::string device_;
};

class OpenSerialLine : public testing::Test {
 protected:
  void SetUp() override {
    if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  }
};

Settings on(const PseudoTerminal& terminal) {
  Settings settings;
  settings.device = terminal.device();
  return settings;
}

Result<std::unique_ptr<Transport>> open_line(const Settings& settings) {
  static boost::asio::io_context io;
  return open(io, settings);
}

std::vector<std::uint8_t> read_some(int fd) {
  pollfd readable{fd, POLLIN, 0};
  std::vector<std::uint8_t> bytes(4096);
  if (::poll(&readable, 1, 1000) != 1) return {};
  const ssize_t got = ::read(fd, bytes.data(), bytes.size());
  bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return bytes;
}

TEST_F(OpenSerialLine, PassesEveryByteUnchanged) {
  const PseudoTerminal terminal;
  const auto line = open_line(on(terminal));
  ASSERT_TRUE(line) << line.error().text();
  std::vector<std::uint8_t> every(256);
  for (std::size_t i = 0; i < every.size(); ++i) every[i] = static_cast<std::uint8_t>(i);  // with ^C, ^S, CR, 0 and FF
  ASSERT_EQ(::write(terminal.master(), every.data(), every.size()), 256);
  EXPECT_EQ(read_some((*line)->fd()), every);
  pollfd echo{terminal.master(), POLLIN, 0};
  EXPECT_EQ(::poll(&echo, 1, 50), 0) << "the line echoes";
}

TEST_F(OpenSerialLine, AcceptsNonStandardSpeeds) {
  for (const int baud : {614'400, 374'400, 1'843'200, 9'600, 921'600, 4'147'200}) {
    const PseudoTerminal terminal;
    Settings settings = on(terminal);
    settings.format.baud = baud;
    const auto line = open_line(settings);
    ASSERT_TRUE(line) << line.error().text();
    EXPECT_EQ(read_line_format((*line)->fd())->baud, baud);
    EXPECT_THAT((*line)->notes(), testing::IsEmpty());
  }
}

TEST_F(OpenSerialLine, DiscardsPendingInput) {
  const PseudoTerminal terminal;
  ASSERT_EQ(::write(terminal.master(), "old\n", 4), 4);
  const auto line = open_line(on(terminal));
  ASSERT_TRUE(line);
  ASSERT_EQ(::write(terminal.master(), "new", 3), 3);
  EXPECT_EQ(read_some((*line)->fd()), (std::vector<std::uint8_t>{'n', 'e', 'w'}));
}

TEST_F(OpenSerialLine, NotesThatAPseudoTerminalHasNoParity) {
  const PseudoTerminal terminal;
  Settings settings = on(terminal);
  settings.format.parity = wire::Parity::kEven;
  const auto line = open_line(settings);
  ASSERT_TRUE(line) << line.error().text();
  EXPECT_THAT((*line)->notes(),
              testing::ElementsAre("found 921600 baud, 8 data bits, parity none, 1 stop bit in force, expected 921600 "
                                   "baud, 8 data bits, parity even, 1 stop bit; no effect on a pseudo-"
                                   "terminal"));
}

TEST_F(OpenSerialLine, RejectsASecondReader) {
  const PseudoTerminal terminal;
  auto first = open_line(on(terminal));
  ASSERT_TRUE(first);
  const auto second = open_line(on(terminal));
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().text(), terminal.device() + ": held by another program; expected it free");
  first->reset();
  EXPECT_TRUE(open_line(on(terminal))) << "the lock outlived its line";
}

// Regression: two daemons had the same device; at every retry the rejected one flushed the other one's bytes.
TEST_F(OpenSerialLine, RejectedReaderDoesNotDiscardInput) {
  const PseudoTerminal terminal;
  const auto line = open_line(on(terminal));
  ASSERT_TRUE(line);
  ASSERT_EQ(::write(terminal.master(), "frame", 5), 5);
  pollfd arrived{(*line)->fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&arrived, 1, 1000), 1);
  ASSERT_FALSE(open_line(on(terminal)));
  EXPECT_EQ(read_some((*line)->fd()), (std::vector<std::uint8_t>{'f', 'r', 'a', 'm', 'e'}));
}

TEST_F(OpenSerialLine, IsClosedByItsDestructorAndNotInherited) {
  const PseudoTerminal terminal;
  int fd = -1;
  {
    auto line = open_line(on(terminal));
    ASSERT_TRUE(line);
    fd = (*line)->fd();
    EXPECT_TRUE(::fcntl(fd, F_GETFD) & FD_CLOEXEC);
    EXPECT_TRUE(::fcntl(fd, F_GETFL) & O_NONBLOCK);
  }
  EXPECT_EQ(::fcntl(fd, F_GETFD), -1);
}

TEST_F(OpenSerialLine, DistinguishesAnUnpluggedLineFromAnIdleOne) {
  PseudoTerminal terminal;
  const auto line = open_line(on(terminal));
  ASSERT_TRUE(line);
  std::array<std::uint8_t, 16> buffer;
  EXPECT_EQ((*line)->read(buffer).kind, Received::Kind::kNothing);
  EXPECT_EQ((*line)->counters(), std::nullopt);  // a pty counts nothing
  terminal.close_master();
  EXPECT_EQ((*line)->read(buffer).kind, Received::Kind::kLost);
}

TEST_F(OpenSerialLine, ReadsAndWritesWithoutWaiting) {
  const PseudoTerminal terminal;
  const auto line = open_line(on(terminal));
  ASSERT_TRUE(line);
  const std::vector<std::uint8_t> question = {'R', '?', '\r'};
  EXPECT_EQ((*line)->write(question), 3u);
  EXPECT_EQ(read_some(terminal.master()), question);
  EXPECT_FALSE((*line)->has_unread());
  ASSERT_EQ(::write(terminal.master(), "21.5", 4), 4);
  pollfd arrived{(*line)->fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&arrived, 1, 1000), 1);
  EXPECT_TRUE((*line)->has_unread());
  std::array<std::uint8_t, 16> buffer;
  const Received received = (*line)->read(buffer);
  EXPECT_EQ(received.kind, Received::Kind::kData);
  EXPECT_EQ(std::string(buffer.begin(), buffer.begin() + received.bytes), "21.5");
}

TEST(SerialLine, RejectsOtherThanSerialDevices) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("plain")) << "text";
  const auto refusal = [](const std::string& device) {
    Settings settings;
    settings.device = device;
    const auto line = open_line(settings);
    return line ? "taken" : line.error().what;
  };
  EXPECT_EQ(refusal(folder.file("absent")), "not there; expected a serial device");
  EXPECT_EQ(refusal(folder.file("plain")), "not a terminal; expected a serial device");
  EXPECT_EQ(refusal("/dev/null"), "not a terminal; expected a serial device");
}

/// Processes with the same open files as this one.
class Others {
 public:
  explicit Others(int count) {
    for (int i = 0; i < count; ++i) {
      const pid_t pid = ::fork();
      if (pid == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (;;) ::pause();
      }
      pids_.push_back(pid);
    }
    std::sort(pids_.begin(), pids_.end());
  }
  ~Others() { end(pids_.size()); }
  void end(std::size_t count) {
    for (; count > 0; --count, pids_.pop_back()) {
      ::kill(pids_.back(), SIGKILL);
      ::waitpid(pids_.back(), nullptr, 0);
    }
  }
  /// As the line names the first of them.
  std::string names(std::size_t most) const {
    std::string names, own;
    std::getline(std::ifstream("/proc/self/comm"), own);
    for (std::size_t i = 0; i < std::min(most, pids_.size()); ++i)
      names += (i > 0 ? ", " : "") + own + " (pid " + std::to_string(pids_[i]) + ")";
    return names;
  }

 private:
  std::vector<pid_t> pids_;
};

TEST(SerialLine, NamesUpToThreeOtherUsers) {
  const test::TemporaryFolder folder;
  const std::string device = folder.file("device");  // other tests have terminals of the same number
  const std::ofstream held(device);
  Others others(4);
  EXPECT_EQ(other_users_of(device), others.names(3));
  others.end(2);
  EXPECT_EQ(other_users_of(device), others.names(3));
  others.end(2);
  EXPECT_EQ(other_users_of(device), "") << "this process is not another user";
  EXPECT_EQ(other_users_of("/dev/no-such-line"), "");
}

TEST(SerialLine, CountsErrorsOfEachKind) {
  EXPECT_EQ((LineCounters{100'000, 1, 20, 300, 4'000, 50'000}.errors()), 54'321);
}

}  // namespace
}  // namespace prism::transport
