// SPDX-License-Identifier: MIT
// Lateness of a subscriber's lines at 1000 frames/s while other clients abuse prismd, compared with the same prismd
// without the abuse. A benchmark, not a test: it prints values and has no limits.
#include <fmt/format.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/file.hpp"
#include "tests/bench/abusers.hpp"
#include "tests/bench/live_program.hpp"

namespace {

namespace fs = std::filesystem;
using prism::bench::Abusers;
using prism::bench::Bench;
using prism::bench::connect_with_patience;
using prism::bench::request;
using prism::bench::send_text;

constexpr double kRateHz = 1000;

struct Scene {
  std::string socket, folder;
  pid_t prismd;
  void disk(const char* word) const { std::ofstream(folder + "/disk") << word; }
};

struct Abuse {
  const char* what;
  std::function<std::unique_ptr<Abusers>(const Scene&)> begin;
};

std::string joined(const std::string& part, std::size_t times, const char* head, const char* between,
                   const char* tail) {
  std::string text = head;
  for (std::size_t i = 0; i < times; ++i) text += (i > 0 ? between : "") + part;
  return text + tail;
}

std::unique_ptr<Abusers> many(int count, const std::function<void(int)>& harm) {
  return std::make_unique<Abusers>(count, harm);
}

std::unique_ptr<Abusers> ask(const Scene& scene, const std::string& text, std::size_t lines) {
  return prism::bench::four_that_ask(scene.socket, text, lines);
}

// Connects, sends `text`, and either disconnects or stays without reading.
std::unique_ptr<Abusers> send_and(bool leave, int clients, const Scene& scene, const std::string& text) {
  return many(2, [=, socket = scene.socket](int) {
    std::vector<int> open;
    for (int i = 0; i < clients; ++i) {
      open.push_back(connect_with_patience(socket));
      send_text(open.back(), text);
    }
    if (!leave) ::sleep(3600);
    for (const int fd : open) ::close(fd);
  });
}

// Writes 30 days of rows, one segment per day, next to the current segment.
void make_archive(const std::string& log) {
  std::string head, row, name;
  for (const auto& entry : fs::directory_iterator(log)) {
    if (entry.path().extension() != ".csv") continue;
    name = entry.path().stem().string();
    name.resize(name.rfind('-'));
    std::ifstream in(entry.path());
    for (std::string line; std::getline(in, line);) {
      const bool is_row = line[0] >= '0' && line[0] <= '9';
      if (is_row) row = line;
      if (!is_row && !line.starts_with("# end")) head += line + "\n";
    }
  }
  std::string day = head;
  for (int second = 0; second < 86'400; ++second) day += row + "\n";
  for (int i = 1; i <= 30; ++i) std::ofstream(fmt::format("{}/{}-200001{:02}T000000Z.csv", log, name, i)) << day;
}

// Requests page after page, and starts again at the end.
std::unique_ptr<Abusers> log_readers(const Scene& scene, int count) {
  make_archive(scene.folder + "/log");
  return many(count, [socket = scene.socket](int) {
    const int fd = connect_with_patience(socket);
    std::string cursor = "earliest", response;
    std::vector<char> buffer(1 << 20);
    for (;;) {
      send_text(fd, request("rows", R"({"limit":10000,"after":")" + cursor + R"("})") + "\n");
      for (response.clear(); !response.ends_with('\n');) {
        const ssize_t size = ::read(fd, buffer.data(), buffer.size());
        if (size <= 0) return;
        response.append(buffer.data(), static_cast<std::size_t>(size));
      }
      constexpr std::string_view kAfter = R"("after":")";
      const std::size_t at = response.rfind(kAfter);
      const bool more = response.rfind(R"("more":true)") != std::string::npos;
      cursor = at == std::string::npos || !more
                   ? "earliest"
                   : response.substr(at + kAfter.size(), response.find('"', at + kAfter.size()) - at - kAfter.size());
    }
  });
}

const std::vector<Abuse>& abuses() {
  using prism::bench::hour_of_history;
  static const std::vector<Abuse> all{
      {"no abuse", [](const Scene&) { return nullptr; }},
      {"4 clients request the status continuously", [](const Scene& s) { return ask(s, request("status"), 1); }},
      {"4 clients request an hour of history", [](const Scene& s) { return ask(s, hour_of_history(), 1); }},
      {"4 clients send batches of 100 such requests",
       [](const Scene& s) { return ask(s, joined(hour_of_history(), 100, "[", ",", "]"), 100); }},
      {"4 clients send batches of 65 kB (rejected)",
       [](const Scene& s) { return ask(s, joined(hour_of_history(), 900, "[", ",", "]"), 1); }},
      {"4 clients send lines of 70 kB",
       [](const Scene& s) { return ask(s, std::string(70'000, ' ') + request("version"), 1); }},
      {"4 clients send notifications continuously",
       [](const Scene& s) {
         return ask(s, joined(request("history", "{}", false), 900, "", "\n", "\n") + request("version"), 1);
       }},
      {"2 processes connect and disconnect continuously", [](const Scene& s) { return send_and(true, 1, s, ""); }},
      {"2 processes request an hour 20 times, disconnect",
       [](const Scene& s) { return send_and(true, 1, s, joined(hour_of_history() + "\n", 20, "", "", "")); }},
      {"250 clients send 20 requests and never read",
       [](const Scene& s) { return send_and(false, 125, s, joined(hour_of_history() + "\n", 20, "", "", "")); }},
      {"20 subscribers never read",
       [](const Scene& s) {
         return send_and(false, 10, s, request("subscribe", R"({"streams":["sample","window","event"]})") + "\n");
       }},
      {"50 reloads per second",
       [](const Scene& s) { return many(1, [pid = s.prismd](int) { ::kill(pid, SIGHUP), ::usleep(20'000); }); }},
      {"1 client reads 30 days of the log repeatedly", [](const Scene& s) { return log_readers(s, 1); }},
      {"4 clients read 30 days of the log repeatedly", [](const Scene& s) { return log_readers(s, 4); }},
      {"the disk is blocked", [](const Scene& s) { return s.disk("hang"), nullptr; }},
      {"each disk sync fails", [](const Scene& s) { return s.disk("eio"), nullptr; }},
      {"the log is deleted 10 times per second",
       [](const Scene& s) {
         return many(1, [log = s.folder + "/log"](int) {
           std::error_code ignored;
           fs::remove_all(log, ignored);
           ::usleep(100'000);
         });
       }},
  };
  return all;
}

struct Place {
  std::string prismd, shim, description, model, folder;
  prism::wire::FrameDescriptionPtr frames;
};

// stderr of prismd is a pipe without a reader, and full.
int full_pipe() {
  int ends[2];
  if (::pipe2(ends, O_NONBLOCK) != 0) std::exit(1);
  const std::string text(4096, 'x');
  while (::write(ends[1], text.data(), text.size()) > 0) {
  }
  ::fcntl(ends[1], F_SETFL, 0);
  return ends[1];
}

void measure(const Place& place, const Abuse& abuse) {
  const std::string folder = place.folder + "/abuse";
  fs::remove_all(folder);
  fs::create_directories(folder);
  Bench bench(place.frames, "prismd", folder);
  Bench::Start start;
  start.log = folder + "/log";
  start.environment = {{"LD_PRELOAD", place.shim}, {"PRISM_DISK", folder + "/disk"}};
  start.error_output = full_pipe();
  bench.start_prismd(place.prismd.c_str(), place.description, "device", place.model, start);
  bench.fill(static_cast<std::size_t>(3601 * kRateHz));
  ::setpriority(PRIO_PROCESS, 0, -10);
  const double alone_us = bench.paced(kRateHz, 10).p99_us;
  const Scene scene{bench.socket(), folder, bench.process()};
  const auto abusers = abuse.begin(scene);
  ::usleep(500'000);
  const prism::bench::Outcome under_abuse = bench.paced(kRateHz, 10);
  ::setpriority(PRIO_PROCESS, 0, 0);
  scene.disk("good");
  fmt::print("{:<50} {:>8.2f} {:>8.2f} {:>+8.2f}   {:.3f} %\n", abuse.what, 1e-3 * alone_us, 1e-3 * under_abuse.p99_us,
             1e-3 * (under_abuse.p99_us - alone_us), 100 * under_abuse.lost);
  std::fflush(stdout);
}

}  // namespace

// usage: bench_abuse PRISMD DISK_SHIM DESCRIPTION MODEL DIRECTORY [NUMBER]...   only these abuses, from 0
int main(int argc, char** argv) {
  if (argc < 6) return 64;
  ::signal(SIGPIPE, SIG_IGN);
  const auto text = prism::read_text_file(argv[3]);
  const auto frames = text
                          ? prism::wire::parse_frame_description(*text, argv[3])
                          : prism::Result<prism::wire::FrameDescriptionPtr>(tl::unexpected<prism::Error>(text.error()));
  if (!frames) {
    fmt::print(stderr, "bench_abuse: {}\n", frames.error().text());
    return 1;
  }
  if (::geteuid() != 0) fmt::print("(only root can run the subscriber at nice -10)\n");
  const Place place{argv[1], argv[2], *text, argv[4], argv[5], *frames};
  fmt::print(
      "p99 lateness of a subscriber at {:g} frames/s, ms, stderr of prismd unread (target: at most 5 more)\n{:<50} "
      "{:>8} {:>8} {:>8}   lost\n",
      kRateHz, "", "before", "during", "added");
  for (std::size_t i = 0; i < abuses().size(); ++i) {
    const bool selected =
        argc == 6 || std::any_of(argv + 6, argv + argc, [i](const char* n) { return std::to_string(i) == n; });
    if (selected) measure(place, abuses()[i]);
  }
  return 0;
}
