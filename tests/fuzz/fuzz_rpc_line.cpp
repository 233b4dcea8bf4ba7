// SPDX-License-Identifier: MIT
// Any bytes as lines of a client: each response is one line of JSON-RPC in UTF-8 with a result or an error, there are
// at most as many responses as requests, and the next valid request gets its response.
#include <algorithm>
#include <cstdint>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/fuzz/require.hpp"
#include "tests/support/daemon_parts.hpp"

namespace {

using namespace prism;
using nlohmann::json;

// A daemon with ten seconds of history.
std::unique_ptr<test::DaemonParts> make_parts() {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("gyro.json")) << R"({"name": "gyro", "clock": "device", "frames": ")" PRISM_SOURCE_DIR
                                          << R"(/config/frames/trplg.json", "line": {"device": "/dev/null"}})";
  const auto setup = pipeline::load_setup(folder.file("gyro.json"));
  require(setup.has_value());
  auto parts = std::make_unique<test::DaemonParts>(*setup);
  std::int64_t arrival_ns = 1'700'000'000'000'000'000;
  parts->begin_session(arrival_ns);
  wire::FrameEncoder encoder(setup->frames);
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> bytes;
    encoder.encode({{10.0}, setup->frames->period_s(), 25.0, 1.5}, bytes);
    parts->feed(bytes, arrival_ns += static_cast<std::int64_t>(setup->frames->period_s() * 1e9));
  }
  return parts;
}

std::size_t requests_in(const std::string& line) {
  const json parsed = json::parse(line, nullptr, false);
  return parsed.is_array() ? std::max<std::size_t>(parsed.size(), 1) : 1;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto parts = make_parts();
  if (size > 4096) return 0;
  socket::Rpc rpc = parts->rpc({[](auto done) { done(make_error("reload", "not here")); }});
  test::Asker asker;
  std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
  for (std::string line; std::getline(lines, line) && asker.client()->open();) {
    test::request(rpc, asker.client(), line);
    std::istringstream answers(asker.read());
    std::size_t answered = 0;
    for (std::string answer; std::getline(answers, answer); ++answered) {
      const json parsed = json::parse(answer, nullptr, false);
      require(parsed.is_object() && parsed.value("jsonrpc", "") == "2.0" && parsed.contains("id"));
      require(parsed.contains("result") != parsed.contains("error"));
    }
    require(answered <= requests_in(line));
  }
  test::request(rpc, asker.client(), R"({"jsonrpc":"2.0","id":"last","method":"version"})");
  require(asker.read().find("\"last\"") != std::string::npos);
  return 0;
}
