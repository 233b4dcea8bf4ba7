// SPDX-License-Identifier: MIT
// Runs a program between a pseudo-terminal and one client; writes, reads and measures for the live benchmark.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/wire/encode/frame_encoder.hpp"

namespace prism::bench {

inline double now_s(clockid_t clock = CLOCK_MONOTONIC) {
  timespec t{};
  ::clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

inline double quantile(std::vector<double>& values, double part) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Pty {
  int master = -1, slave = -1;  // the slave stays open, so that data written before the reader opens it is kept
  std::string path;
};

inline Pty open_pty() {
  Pty pty;
  pty.master = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  ::grantpt(pty.master);
  ::unlockpt(pty.master);
  pty.path = ::ptsname(pty.master);
  pty.slave = ::open(pty.path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios raw{};
  ::tcgetattr(pty.slave, &raw);
  ::cfmakeraw(&raw);
  ::tcsetattr(pty.slave, TCSANOW, &raw);
  return pty;
}

// A line through TCP on the loopback interface: listens; `master` is the accepted connection.
struct TcpLine {
  int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string address;

  TcpLine() {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof own;
    ::bind(listener, reinterpret_cast<sockaddr*>(&own), size);
    ::listen(listener, 1);
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&own), &size);
    address = fmt::format("127.0.0.1:{}", ntohs(own.sin_port));
  }
  ~TcpLine() { ::close(listener); }
  int accept() const {
    const int line = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC), yes = 1;
    ::setsockopt(line, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    return line;
  }
};

inline int connect_with_patience(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  for (int attempt = 0; attempt < 500; ++attempt) {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return fd;
    ::close(fd);
    ::usleep(10'000);
  }
  fmt::print(stderr, "bench_live: {}: no program accepts connections\n", path);
  std::exit(1);
}

inline void write_all(int fd, const std::uint8_t* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(fd, data, size);
    if (written <= 0) continue;
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

struct Outcome {
  double latency_us = 0;        // median
  double p99_us = 0;            // of lateness, if every frame had a line; else NaN
  double cpu_us_per_frame = 0;  // of the program under test, user + system
  double lines_per_s = 0;
  double lost = 0;  // fraction of the frames without a line
};

inline Outcome outcome_of(std::size_t frames, std::size_t lines, double seconds, double cpu_s) {
  const auto count = static_cast<double>(frames);
  return {0, std::nan(""), 1e6 * cpu_s / count, static_cast<double>(lines) / seconds,
          1 - static_cast<double>(lines) / count};
}

// The program under test, its line and the client.
class Bench {
 public:
  Bench(wire::FrameDescriptionPtr frames, const std::string& name, std::string folder, bool through_tcp = false)
      : frames_(std::move(frames)), pty_(open_pty()), folder_(std::move(folder)) {
    if (through_tcp) tcp_.emplace();
    static int number = 0;
    socket_ = fmt::format("{}/{}{}.sock", folder_, name, ++number);
    ::unlink(socket_.c_str());
  }
  ~Bench() {
    ::kill(child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
    ::close(client_);
    ::close(pty_.master);
    ::close(pty_.slave);
  }

  void start_relay(const char* program, std::size_t frame_bytes, std::size_t line_bytes) {
    const std::string device = tcp_ ? tcp_->address : pty_.path;
    spawn({program, device, socket_, std::to_string(frame_bytes), std::to_string(line_bytes)});
    accept_line();
    client_ = connect_with_patience(socket_);
  }

  /// Additional settings for prismd.
  struct Start {
    std::string log;  // a directory; empty: no log
    std::vector<std::pair<std::string, std::string>> environment;
    int error_output = STDERR_FILENO;
  };

  void start_prismd(const char* program, const std::string& description, const char* clock, const std::string& model,
                    const Start& start = {"", {}, STDERR_FILENO}) {
    const std::string config = folder_ + "/bench.json", frames = folder_ + "/frames.json";
    std::ofstream(frames) << description;
    std::ofstream(config) << fmt::format(
        R"({{"line": {{{}}}, "frames": "{}", "clock": "{}", "model": "{}", {}, "event_level": "{}",
            "socket": {{"path": "{}", "client_buffer_kib": 4096}}}})",
        tcp_ ? fmt::format(R"("tcp": {{"address": "{}"}})", tcp_->address)
             : fmt::format(R"("device": "{}")", pty_.path),
        frames, clock, model,
        start.log.empty() ? R"("write_log": false)" : fmt::format(R"("log": {{"directory": "{}"}})", start.log),
        start.error_output == STDERR_FILENO ? "error" : "debug", socket_);
    spawn({program, config}, start);
    accept_line();
    client_ = connect_with_patience(socket_);
    const std::string ask =
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"subscribe\",\"params\":{\"streams\":[\"sample\"]}}\n";
    if (::write(client_, ask.data(), ask.size()) < 0) std::exit(1);
    char answer[512];
    if (::read(client_, answer, sizeof answer) <= 0) std::exit(1);
  }

  /// Bytes of the first line received for three frames; 0 if none arrived.
  std::size_t line_bytes() {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 3; ++i) {
      bytes.clear();
      encode(bytes);
      write_all(pty_.master, bytes.data(), bytes.size());
      ::usleep(20'000);
    }
    char buffer[4096];
    const ssize_t size = ::read(client_, buffer, sizeof buffer);
    const char* end =
        static_cast<const char*>(std::memchr(buffer, '\n', static_cast<std::size_t>(std::max<ssize_t>(size, 0))));
    return end != nullptr ? static_cast<std::size_t>(end - buffer + 1) : 0;
  }

  Outcome paced(double rate_hz, double seconds) {
    const auto count = static_cast<std::size_t>(rate_hz * seconds);
    std::vector<double> written(count);
    std::vector<double> arrived;
    arrived.reserve(count);
    std::atomic<bool> done = false;
    drain(0.2);
    std::thread reader(
        [&] { read_lines(done, [&](std::size_t lines, double time) { arrived.insert(arrived.end(), lines, time); }); });
    const double cpu_before = cpu_s(), begin = now_s();
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < count; ++i) {
      bytes.clear();
      encode(bytes);
      const double due = begin + static_cast<double>(i) / rate_hz;
      timespec wake{static_cast<time_t>(due), static_cast<long>((due - std::floor(due)) * 1e9)};
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
      written[i] = now_s();
      write_all(pty_.master, bytes.data(), bytes.size());
    }
    ::usleep(100'000);
    const double cpu = cpu_s() - cpu_before;
    done = true;
    reader.join();
    Outcome outcome = outcome_of(count, arrived.size(), seconds, cpu);
    // A line belongs to the last frame written before it arrived, because frames are many latencies apart. Counting
    // would be wrong: some frames have no line (the first one, and one with which the clock restarts after a pause).
    std::vector<double> latency;
    for (const double time : arrived) {
      const auto behind = std::upper_bound(written.begin(), written.end(), time);
      if (behind != written.begin()) latency.push_back(time - *(behind - 1));
    }
    if (!latency.empty()) outcome.latency_us = 1e6 * quantile(latency, 0.5);
    if (arrived.size() == count) {  // then line by line: a line that is later than the next frame counts in full
      for (std::size_t i = 0; i < count; ++i) arrived[i] -= written[i];
      outcome.p99_us = 1e6 * quantile(arrived, 0.99);
    }
    return outcome;
  }

  /// Sends `count` frames in blocks of about 60 kB, as fast as the line accepts them.
  void fill(std::size_t count) {
    std::vector<std::uint8_t> bytes;
    std::atomic<bool> done = false;
    std::thread reader([&] { read_lines(done, [](std::size_t, double) {}); });
    for (std::size_t i = 0; i < count; ++i) {
      encode(bytes);
      if (bytes.size() < 60'000 && i + 1 < count) continue;
      write_all(pty_.master, bytes.data(), bytes.size());
      bytes.clear();
    }
    ::usleep(500'000);
    done = true;
    reader.join();
  }

  const std::string& socket() const { return socket_; }
  pid_t process() const { return child_; }

  Outcome flood(std::size_t count) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < count; ++i) encode(bytes);
    std::atomic<bool> done = false;
    std::atomic<std::size_t> lines = 0;
    double last = 0;
    drain(0.2);
    std::thread reader([&] { read_lines(done, [&](std::size_t n, double time) { lines += n, last = time; }); });
    const double cpu_before = cpu_s(), begin = now_s();
    write_all(pty_.master, bytes.data(), bytes.size());
    std::size_t seen = 0;
    for (double quiet = now_s(); now_s() - quiet < 0.3;) {
      if (lines != seen) seen = lines, quiet = now_s();
      ::usleep(10'000);
    }
    const double cpu = cpu_s() - cpu_before;
    done = true;
    reader.join();
    return outcome_of(count, lines, last - begin, cpu);
  }

 private:
  void accept_line() {
    if (!tcp_) return;
    ::close(pty_.master);
    pty_.master = tcp_->accept();
  }

  void spawn(const std::vector<std::string>& words, const Start& start = {"", {}, STDERR_FILENO}) {
    child_ = ::fork();
    if (child_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // so that an interrupted benchmark leaves no process on a pty that is reused
    for (const auto& [name, value] : start.environment) ::setenv(name.c_str(), value.c_str(), 1);
    ::dup2(start.error_output, STDERR_FILENO);
    std::vector<char*> argv;
    for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }

  void encode(std::vector<std::uint8_t>& bytes) {
    wire::GyroState state;
    state.rate_deg_per_h = {8.4652};
    state.interval_s = frames_->period_s();
    state.temperature_degc = 25.0 + 0.001 * static_cast<double>(++encoded_ % 1000);
    state.uhfo_v = 5.32;
    encoder_.encode(state, bytes);
  }

  double cpu_s() const {
    clockid_t clock;
    if (::clock_getcpuclockid(child_, &clock) != 0) return 0;
    return now_s(clock);
  }

  template <class Take>
  void read_lines(const std::atomic<bool>& done, Take take) {
    std::vector<char> buffer(1 << 20);
    while (!done) {
      pollfd wait{client_, POLLIN, 0};
      if (::poll(&wait, 1, 50) <= 0) continue;
      const ssize_t size = ::read(client_, buffer.data(), buffer.size());
      if (size <= 0) return;
      const double time = now_s();
      take(static_cast<std::size_t>(std::count(buffer.begin(), buffer.begin() + size, '\n')), time);
    }
  }

  void drain(double seconds) {
    std::atomic<bool> done = false;
    std::thread reader([&] { read_lines(done, [](std::size_t, double) {}); });
    ::usleep(static_cast<useconds_t>(seconds * 1e6));
    done = true;
    reader.join();
  }

  wire::FrameDescriptionPtr frames_;
  wire::FrameEncoder encoder_{frames_};
  Pty pty_;
  std::optional<TcpLine> tcp_;
  std::string socket_, folder_;
  pid_t child_ = -1;
  int client_ = -1;
  std::uint64_t encoded_ = 0;
};

}  // namespace prism::bench
