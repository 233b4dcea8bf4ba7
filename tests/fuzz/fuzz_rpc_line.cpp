// SPDX-License-Identifier: MIT
// Any bytes as lines of a client: each answer is one line of JSON-RPC in UTF-8, with a result or an error, there are no
// more of them than requests, and the client is as it was: the next request is answered.
#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <cstdint>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/instance.hpp"
#include "daemon/rpc.hpp"
#include "drivers/wire/encode/frame_encoder.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace prism;
using nlohmann::json;
using Socket = boost::asio::local::stream_protocol::socket;

// With a history of ten seconds, and an event.
std::unique_ptr<daemon::Instance> make_instance() {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("gyro.json")) << R"({"name": "gyro", "clock": "device", "frames": ")" PRISM_SOURCE_DIR
                                          << R"(/config/frames/trplg.json", "line": {"device": "/dev/null"}})";
  const auto setup = pipeline::load_setup(folder.file("gyro.json"));
  require(setup.has_value());
  auto instance = std::make_unique<daemon::Instance>(*setup, std::vector<std::unique_ptr<daemon::RowWriter>>(), nullptr,
                                                     [](const daemon::Event&) {});
  std::int64_t arrival_ns = 1'700'000'000'000'000'000;
  instance->begin_session(arrival_ns);
  instance->set_line(daemon::LineState::kReceiving);
  wire::FrameEncoder encoder(setup->frames);
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> bytes;
    encoder.encode({{10.0}, setup->frames->period_s(), 25.0, 1.5}, bytes);
    instance->feed(bytes, arrival_ns += static_cast<std::int64_t>(setup->frames->period_s() * 1e9));
  }
  return instance;
}

/// A client and what it is told.
struct Asker {
  Asker() : mine(io) {
    Socket theirs(io);
    boost::asio::local::connect_pair(mine, theirs);
    client = std::make_shared<daemon::Client>(std::move(theirs), 1 << 20);
  }
  ~Asker() { client->close(); }

  std::string read() {
    std::string text;
    char buffer[65536];
    for (;;) {
      io.restart();
      io.poll();
      const ssize_t got = ::recv(mine.native_handle(), buffer, sizeof buffer, MSG_DONTWAIT);
      if (got <= 0) return text;
      text.append(buffer, static_cast<std::size_t>(got));
    }
  }

  boost::asio::io_context io;
  Socket mine;
  std::shared_ptr<daemon::Client> client;
};

std::size_t requests_in(const std::string& line) {
  const json parsed = json::parse(line, nullptr, false);
  return parsed.is_array() ? std::max<std::size_t>(parsed.size(), 1) : 1;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto instance = make_instance();
  if (size > 4096) return 0;
  daemon::Rpc rpc(*instance, [](auto done) { done(refuse("reload", "not here")); });
  Asker asker;
  std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
  for (std::string line; std::getline(lines, line) && asker.client->open();) {
    rpc.request(asker.client, line);
    std::istringstream answers(asker.read());
    std::size_t answered = 0;
    for (std::string answer; std::getline(answers, answer); ++answered) {
      const json parsed = json::parse(answer, nullptr, false);
      require(parsed.is_object() && parsed.value("jsonrpc", "") == "2.0" && parsed.contains("id"));
      require(parsed.contains("result") != parsed.contains("error"));
    }
    require(answered <= requests_in(line));
  }
  rpc.request(asker.client, R"({"jsonrpc":"2.0","id":"last","method":"version"})");
  require(asker.read().find("\"last\"") != std::string::npos);
  return 0;
}
