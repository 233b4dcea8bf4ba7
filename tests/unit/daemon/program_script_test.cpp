// SPDX-License-Identifier: MIT
// Replays, --sniff and --check of documents as scripts: the exit code and all that is printed.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "daemon/program.hpp"
#include "drivers/capture_file.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/support/emulated.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::daemon {
namespace {

using test::next;
using test::rest_of;
using Lines = std::vector<std::string>;

/// A gyro of trplg at 200 Hz, if not configured. @ is the folder of the files, SOURCE that of the project.
class ProgramPlayer {
 public:
  ProgramPlayer() { configure(""); }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "config") {  // MEMBERS
      configure(path_of(rest_of(words)));
    } else if (command == "file") {  // NAME TEXT
      const auto name = next<std::string>(words);
      std::ofstream(path_of(name)) << path_of(rest_of(words));
    } else if (command == "copy") {  // PATH NAME
      const std::string path = path_of(next<std::string>(words));
      std::filesystem::copy(path, path_of(next<std::string>(words)));
    } else if (command == "bytes") {  // NAME of raw bytes; N good frames, -N damaged ones, lN lost ones, TEXT
      const auto name = next<std::string>(words);
      std::ofstream(path_of(name), std::ios::app) << bytes_of(words);
    } else if (command == "capture") {  // NAME; |TIME of an opening, TIME:N frames or TIME:=TEXT
      return capture(path_of(next<std::string>(words)), words);
    } else if (command == "cut") {  // NAME BYTES from its end
      const std::string path = path_of(next<std::string>(words));
      std::filesystem::resize_file(path, std::filesystem::file_size(path) - next<std::size_t>(words));
    } else if (command == "damage") {  // NAME OFFSET
      std::fstream file(path_of(next<std::string>(words)), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(next<int>(words));
      file << std::string(24, '\xFF');
    } else if (command == "replay") {  // FILE... and options
      return replay(words);
    } else if (command == "size") {  // of a file
      return {fmt::format("{} bytes", std::filesystem::file_size(path_of(next<std::string>(words))))};
    } else if (command == "sniff") {  // PATH [DESCRIPTION]
      const std::string path = path_of(next<std::string>(words));
      const std::string description = path_of(next<std::string>(words));
      return run([&] { return run_sniff(path, description); });
    } else if (command == "sniff_port") {  // N frames come through TCP
      return sniff_port(next<int>(words));
    } else if (command == "sniff_terminal") {  // N frames again and again; DESCRIPTION
      const int count = next<int>(words);
      return sniff_terminal(count, path_of(next<std::string>(words)));
    } else if (command == "check") {  // PATH of a document
      const std::string path = path_of(next<std::string>(words));
      return run([&] { return check_document(path); });
    } else {
      return {"unknown command"};
    }
    return {};
  }

 private:
  std::string path_of(const std::string& text) const {
    const std::string with_folder = std::regex_replace(text, std::regex("@"), folder_.file(""));
    return std::regex_replace(with_folder, std::regex("SOURCE"), PRISM_SOURCE_DIR);
  }
  void configure(const std::string& members) {
    auto json =
        nlohmann::ordered_json::parse(R"({"name": "gyro", "clock": "device", "line": {"device": "/dev/null"}})");
    json["frames"] = PRISM_SOURCE_DIR "/config/frames/trplg.json";
    json.update(nlohmann::ordered_json::parse("{" + members + "}"));
    std::ofstream(folder_.file("gyro.json")) << json;
    encoder_.emplace(load().frames);
  }
  pipeline::Setup load(const pipeline::Overrides& overrides = {}) {
    auto setup = pipeline::load_setup(folder_.file("gyro.json"), overrides);
    if (!setup) throw std::runtime_error(setup.error().text());
    return *setup;
  }
  std::string frames(int count) {
    std::vector<std::uint8_t> bytes;
    const wire::GyroState state{.rate_deg_per_h = {10.0}, .interval_s = 0.005, .temperature_degc = 25.0, .uhfo_v = 1.5};
    for (int i = 0; i < std::abs(count); ++i) {
      encoder_->encode(state, bytes);
      if (count < 0) bytes.back() = static_cast<std::uint8_t>(~bytes.back());
    }
    return {bytes.begin(), bytes.end()};
  }
  std::string bytes_of(std::istream& words) {
    std::string bytes;
    for (std::string word; words >> word;) bytes += bytes_of(word);
    return bytes;
  }
  std::string bytes_of(const std::string& word) {
    if (word[0] == 'l') encoder_->skip({.rate_deg_per_h = {10.0}, .interval_s = 0.005}, std::stoul(word.substr(1)));
    if (word[0] == 'l') return "";
    const bool is_number = std::isdigit(word.back()) != 0 && (std::isdigit(word[0]) != 0 || word[0] == '-');
    return is_number ? frames(std::stoi(word)) : word;
  }
  Lines capture(const std::string& path, std::istream& words) {
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    auto writer = drivers::CaptureWriter::open(path);
    std::int64_t time_ns = 1'700'000'000'000'000'000;
    const auto at = [&](const std::string& text) {
      return 1'700'000'000'000'000'000 + std::llround(1e9 * std::stod(text));
    };
    for (std::string word; words >> word;) {
      const std::size_t colon = word.find(':');
      if (word[0] == '|') {
        EXPECT_TRUE(writer->opened(at(word.substr(1))));
        continue;
      }
      time_ns = at(word.substr(0, colon));
      const std::string what = word.substr(colon + 1);
      if (what[0] == '=') put(*writer, time_ns, what.substr(1) + "\r\n");
      for (int i = 0; what[0] != '=' && i < std::stoi(what); ++i, time_ns += 5'000'000)
        put(*writer, time_ns, frames(1));
    }
    EXPECT_TRUE(writer->flush());
    return {};
  }
  static void put(drivers::CaptureWriter& writer, std::int64_t time_ns, const std::string& bytes) {
    EXPECT_TRUE(writer.data(time_ns, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}));
  }
  Lines replay(std::istream& words) {
    Options options;
    options.overrides.replay_log = folder_.file(fmt::format("out{}", ++replays_));
    for (std::string word; words >> word;) {
      if (word == "--check") options.check = true;
      if (word == "--sensors") options.replay_sensors.push_back(path_of(next<std::string>(words)));
      if (word == "--frames") options.out_frames = path_of(next<std::string>(words));
      if (word == "--speed") options.speed = next<double>(words);
      if (word == "--out") options.overrides.replay_log = path_of(next<std::string>(words));
      if (!word.starts_with("--")) options.replay.push_back(path_of(word));
    }
    options.config = folder_.file("gyro.json");
    return run([&] { return run_replay(options, load(options.overrides)); });
  }
  Lines sniff_port(int count) {
    boost::asio::io_context io;
    boost::asio::ip::tcp::acceptor acceptor(io, {boost::asio::ip::address_v4::loopback(), 0});
    const std::string address = fmt::format("127.0.0.1:{}", acceptor.local_endpoint().port());
    std::thread device([&] {
      auto peer = acceptor.accept();
      boost::asio::write(peer, boost::asio::buffer(frames(count)));
      boost::system::error_code error;
      char end = 0;
      peer.read_some(boost::asio::buffer(&end, 1), error);  // until the sniffer closes
    });
    Lines given = run([&] { return run_sniff(address, path_of("SOURCE/config/frames/trplg.json")); });
    device.join();
    for (std::string& line : given) line = without_rate(std::regex_replace(line, std::regex(address), "ADDRESS"));
    return given;
  }
  static std::string without_rate(const std::string& line) {
    return std::regex_replace(line, std::regex("[0-9]+ frames, 100.0 % of .*"), "all bytes");
  }
  Lines sniff_terminal(int count, const std::string& description) {
    int main = -1, other = -1;
    char name[64] = "";
    if (::openpty(&main, &other, name, nullptr, nullptr) != 0) return {"no terminal"};
    std::atomic<bool> over = false;
    std::thread device([&] {
      const std::string bytes = frames(count);
      while (!over) {
        if (!bytes.empty() && ::write(main, bytes.data(), bytes.size()) < 0) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
    Lines given = run([&] { return run_sniff(name, description); });
    over = true;
    device.join();
    ::close(main), ::close(other);
    for (std::string& line : given) line = without_rate(std::regex_replace(line, std::regex(name), "TTY"));
    return given;
  }
  Lines run(const std::function<int()>& program) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = program();
    spdlog::default_logger()->flush();
    Lines given = {fmt::format("exit {}", code)};
    for (const auto& [mark, text] :
         {std::pair("", testing::internal::GetCapturedStdout()), {"! ", testing::internal::GetCapturedStderr()}}) {
      std::istringstream in(plain(text));
      for (std::string line; std::getline(in, line);) given.push_back(mark + line);
    }
    return given;
  }
  std::string plain(std::string text) const {
    text = std::regex_replace(text, std::regex(folder_.file("")), "@");
    text = std::regex_replace(text, std::regex(PRISM_SOURCE_DIR), "SOURCE");
    text = std::regex_replace(text, std::regex("\\[20..-..-.. [0-9:.]*\\] "), "");
    return std::regex_replace(text, std::regex("in [0-9.]+ s \\([0-9.]+ million/s\\)"), "in TIME");
  }

  test::TemporaryFolder folder_;
  std::optional<wire::FrameEncoder> encoder_;
  int replays_ = 0;
};

TEST(Program, Scripts) { test::expect_scripts<ProgramPlayer>("daemon/program.txt"); }

TEST(Program, SniffsATerminal) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  test::expect_scripts<ProgramPlayer>("daemon/sniff_terminal.txt");
}

}  // namespace
}  // namespace prism::daemon
