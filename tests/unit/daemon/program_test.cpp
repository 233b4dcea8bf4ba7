// SPDX-License-Identifier: MIT
// Ends of prismd without a live line: --sniff of a connection that is closed, and a replay that loses rows.
#include "daemon/program.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/daemon_parts.hpp"
#include "tests/support/disk_files.hpp"

namespace prism::daemon {
namespace {

using boost::asio::ip::tcp;
using testing::EndsWith, testing::HasSubstr;

struct ProgramTest : test::DaemonPartsTest {
  /// The exit code; keeps what was printed.
  int run(const std::function<int()>& program) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = program();
    out = testing::internal::GetCapturedStdout();
    err = testing::internal::GetCapturedStderr();
    return code;
  }
  int sniff(const std::string& path) {
    return run([&] { return run_sniff(path, PRISM_SOURCE_DIR "/config/frames/trplg.json"); });
  }
  std::string out, err;
};

TEST_F(ProgramTest, SniffEndsWithItsConnection) {
  boost::asio::io_context io;
  tcp::acceptor acceptor(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
  const std::string address = fmt::format("127.0.0.1:{}", acceptor.local_endpoint().port());
  std::thread device([&] { acceptor.accept().close(); });
  EXPECT_EQ(sniff(address), kExitFailed);
  EXPECT_THAT(err, EndsWith(address + ": the line was lost while listening\n"));
  device.join();
  acceptor.close();
  EXPECT_EQ(sniff(address), kExitFailed);
  EXPECT_THAT(err, HasSubstr("connection refused"));
}

TEST_F(ProgramTest, AReplayThatLosesRowsFails) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 450; ++i) encoder_.encode({{10.0}, setup_.frames->period_s(), 25.0, 1.5}, bytes);
  test::write_file(folder_.file("log"), "in the way");
  test::write_file(folder_.file("bytes"), {bytes.begin(), bytes.end()});
  setup_.config.log = test::segments_in(folder_.file("log"));
  Options options;
  options.replay = {folder_.file("bytes")};
  EXPECT_EQ(run([&] { return run_replay(options, setup_); }), kExitFailed);
  EXPECT_THAT(err, EndsWith("; rows are dropped and counted until it works again; 3 rows lost\n"));
  EXPECT_EQ(out, "");
}

}  // namespace
}  // namespace prism::daemon
