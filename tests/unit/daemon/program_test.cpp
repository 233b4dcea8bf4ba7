// SPDX-License-Identifier: MIT
// The output of prismd without a live line: --sniff, --check of a document, and a replay.
#include "daemon/program.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/capture_file.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/disk_files.hpp"

namespace prism::daemon {
namespace {

using boost::asio::ip::tcp;
using testing::EndsWith, testing::HasSubstr, testing::MatchesRegex, testing::Not, testing::StartsWith;

const std::string kFrames = PRISM_SOURCE_DIR "/config/frames/", kModels = PRISM_SOURCE_DIR "/config/models/";

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
  int sniff(const std::string& path, const std::string& description) {
    return run([&] { return run_sniff(path, kFrames + description + ".json"); });
  }
  std::string frames(int count) {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < count; ++i) encoder_.encode({{10.0}, setup_.frames->period_s(), 25.0, 1.5}, bytes);
    return {bytes.begin(), bytes.end()};
  }
  std::string file(const std::string& text, const std::string& name = "bytes") {
    test::write_file(folder_.file(name), text);
    return folder_.file(name);
  }
  int replay(
      const std::string& capture, const std::function<void(Options&)>& change = [](auto&) {}) {
    Options options;
    options.replay = {capture};
    change(options);
    return run([&] { return run_replay(options, setup_); });
  }

  std::string out, err;
};

TEST_F(ProgramTest, SniffFindsTheDescription) {
  const std::string good = file(frames(400));
  EXPECT_EQ(sniff(good, "trplg"), kExitDone);
  EXPECT_THAT(out, MatchesRegex(good + ": fits\n  trplg[^\n]*\n"));
  EXPECT_EQ(sniff(good, "dsp3000"), kExitFailed);
  EXPECT_THAT(out, StartsWith(good + ": nothing fits\n"));
}

TEST_F(ProgramTest, SniffExplainsWhyTheOneDescriptionDoesNotFit) {
  std::string bytes;
  for (int i = 0; i < 400; ++i) {
    std::string one = frames(1);
    one.back() = static_cast<char>(~one.back());
    bytes += one;
  }
  EXPECT_EQ(sniff(file(bytes), "trplg"), kExitFailed);
  const auto lines = std::count(out.begin(), out.end(), '\n');
  EXPECT_GE(lines, 2) << out;
  const std::string one = out;
  EXPECT_EQ(run([&] { return run_sniff(folder_.file("bytes"), ""); }), kExitFailed);
  EXPECT_THAT(out, StartsWith(folder_.file("bytes") + ": nothing fits\n"));
  EXPECT_LE(std::count(out.begin(), out.end(), '\n'), 4) << "the three nearest: " << out;
}

TEST_F(ProgramTest, SniffSaysWhenThereIsTooLittle) {
  EXPECT_EQ(sniff(file(""), "trplg"), kExitFailed);
  EXPECT_THAT(out, EndsWith(": no byte came\n"));
  EXPECT_EQ(sniff(file(frames(1)), "trplg"), kExitFailed);
  EXPECT_THAT(out, HasSubstr(": one frame, too few to be sure\n"));
  EXPECT_EQ(sniff(file(frames(2)), "trplg"), kExitFailed);
  EXPECT_THAT(out, HasSubstr(": two frames, too few to be sure\n"));
  EXPECT_EQ(sniff(file(frames(3)), "trplg"), kExitDone);
  EXPECT_EQ(sniff(folder_.file("none"), "trplg"), kExitFailed);
  EXPECT_THAT(err, HasSubstr("none: cannot be read: No such file or directory"));
  EXPECT_EQ(sniff(file(frames(3)), "none"), kExitFailed);
}

TEST_F(ProgramTest, SniffEndsWithItsConnection) {
  boost::asio::io_context io;
  tcp::acceptor acceptor(io, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
  const std::string address = fmt::format("127.0.0.1:{}", acceptor.local_endpoint().port());
  std::thread device([&] { acceptor.accept().close(); });
  EXPECT_EQ(sniff(address, "trplg"), kExitFailed);
  EXPECT_THAT(err, EndsWith(address + ": the line was lost while listening\n"));
  device.join();
  acceptor.close();
  EXPECT_EQ(sniff(address, "trplg"), kExitFailed);
  EXPECT_THAT(err, HasSubstr("connection refused"));
}

TEST_F(ProgramTest, CheckOfADocument) {
  const auto check = [this](const std::string& path) { return run([&] { return check_document(path); }); };
  EXPECT_EQ(check(kModels + "tao2019-model1.json"), kExitDone);
  EXPECT_THAT(out, MatchesRegex(".*/tao2019-model1.json: good: model [0-9a-f]{12}, [^\n]*\n"));
  EXPECT_EQ(check(kFrames + "trplg.json"), kExitDone);
  EXPECT_THAT(out, Not(HasSubstr("note: a configuration finds it by its file")));
  EXPECT_THAT(out, HasSubstr("trplg.json: good: "));
  EXPECT_EQ(check(file(test::content(kFrames + "trplg.json"), "renamed.json")), kExitDone);
  EXPECT_THAT(out, HasSubstr("note: a configuration finds it by its file, \"renamed\"; its name \"trplg\" is in logs"));
  for (const char* format : {"prism-model", "prism-frames"}) {
    EXPECT_EQ(check(file(fmt::format(R"({{"format": "{}"}})", format))), kExitConfig);
    EXPECT_THAT(err, StartsWith("prismd: " + folder_.file("bytes")));
  }
  EXPECT_EQ(check(file(R"({"name": "gyro"})")), -1);
  EXPECT_EQ(check(file("no document")), -1);
  EXPECT_EQ(check(folder_.file("none")), -1);
}

TEST_F(ProgramTest, AReplaySaysWhatItDid) {
  const std::string bytes = file(frames(450) + "..");
  setup_.config.log = test::segments_in(folder_.file("log"));
  EXPECT_EQ(replay(bytes), kExitDone) << err;
  EXPECT_THAT(out, MatchesRegex("replayed 450 frames in [0-9.]+ s \\([0-9.]+ million/s\\), 0 failed their check, 0 "
                                "missing, 2 bytes skipped\nlog: 3 rows in " +
                                folder_.file("log") +
                                "\nbias stability: none: found 0 corrected means, expected two or more [^\n]*\n"));
  EXPECT_EQ(replay(bytes, [](Options& options) { options.check = true; }), kExitDone);
  EXPECT_THAT(out, HasSubstr("frames               450\n"));
  EXPECT_EQ(replay(file("no frame at all")), kExitFailed);
  EXPECT_THAT(err, HasSubstr("found no frame of \"trplg\" in 15 bytes, expected at least one"));
}

TEST_F(ProgramTest, AReplayThatLosesRowsFails) {
  setup_.config.log = test::segments_in(file("in the way", "log"));
  EXPECT_EQ(replay(file(frames(450))), kExitFailed);
  EXPECT_THAT(err, EndsWith("; rows are dropped and counted until it works again; 3 rows lost\n"));
  EXPECT_EQ(out, "");
}

}  // namespace
}  // namespace prism::daemon
