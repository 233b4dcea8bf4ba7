// SPDX-License-Identifier: MIT
// The simulated gyro on a pseudo-terminal: no byte is lost with a slow, late or returning reader.
#include "tools/prismsim/terminal_run.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "base/file.hpp"
#include "drivers/transport/transport.hpp"
#include "drivers/wire/decode/frame_decoder.hpp"
#include "tests/support/emulated.hpp"
#include "tests/support/shared_files.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/prismsim/pseudo_terminal.hpp"

namespace prism::prismsim {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

wire::FrameDescriptionPtr trplg() {
  const std::string path = std::string(PRISM_SOURCE_DIR) + "/config/frames/trplg.json";
  return *wire::parse_frame_description(test::read_file(path), path);
}

SimOptions run_of(double seconds, std::optional<double> speed) {
  SimOptions options;
  options.frames = trplg();
  options.duration_s = seconds;
  options.terminal = options.wait = true;
  options.speed = speed;
  return options;
}

// Opens the terminal as prismd would and decodes until it is disconnected or `most` frames have arrived.
wire::DecoderCounters read_frames(const std::string& device, milliseconds pause,
                                  std::uint64_t most = ~std::uint64_t{0}) {
  transport::Settings settings;
  settings.device = device;
  boost::asio::io_context io;
  const auto line = transport::open(io, settings);
  if (!line) return {};
  wire::FrameDecoder decoder(trplg());
  std::vector<wire::DecodedMessage> readings;
  std::vector<std::uint8_t> bytes(65536);
  while (decoder.counters().frames < most) {
    pollfd readable{(*line)->fd(), POLLIN, 0};
    if (::poll(&readable, 1, 5000) != 1) break;
    const ssize_t got = ::read((*line)->fd(), bytes.data(), bytes.size());
    if (got <= 0) break;
    readings.clear();
    decoder.feed({bytes.data(), static_cast<std::size_t>(got)}, 0, readings);
    std::this_thread::sleep_for(pause);
  }
  return decoder.counters();
}

simulation::SimulationCounters run(const SimOptions& options, PseudoTerminal& terminal) {
  const auto counters = run_terminal(options, terminal);
  EXPECT_TRUE(counters) << counters.error().text();
  return *counters;
}

TEST(TerminalRun, LosesNothingWithASlowReader) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  std::optional<PseudoTerminal> terminal = std::move(*PseudoTerminal::open(""));
  wire::DecoderCounters read;
  std::thread reader([&, device = terminal->path()] { read = read_frames(device, milliseconds(1)); });
  const simulation::SimulationCounters sent = run(run_of(100, std::nullopt), *terminal);
  terminal.reset();  // hangs up
  reader.join();
  EXPECT_EQ(sent.frames, 20'000u);
  EXPECT_EQ(read.frames, 20'000u);
  EXPECT_EQ(read.skipped_bytes, 0u);
}

TEST(TerminalRun, ContinuesForAReaderThatReturns) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  std::optional<PseudoTerminal> terminal = std::move(*PseudoTerminal::open(""));
  wire::DecoderCounters first, second;
  std::thread reader([&, device = terminal->path()] {
    first = read_frames(device, milliseconds(0), 1000);
    std::this_thread::sleep_for(milliseconds(100));
    second = read_frames(device, milliseconds(0));
  });
  run(run_of(100, std::nullopt), *terminal);
  terminal.reset();
  reader.join();
  EXPECT_GE(first.frames, 1000u);
  EXPECT_GE(second.frames, 17'000u);  // the terminal's content at the change is lost: at most about 20 kB
  EXPECT_LE(first.frames + second.frames, 20'000u);
}

// 3 s of gyro time at three times real time take one second, however long a frame takes to make.
TEST(TerminalRun, SendsOnTime) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  std::optional<PseudoTerminal> terminal = std::move(*PseudoTerminal::open(""));
  wire::DecoderCounters read;
  std::thread reader([&, device = terminal->path()] { read = read_frames(device, milliseconds(0)); });
  const auto begin = Clock::now();
  run(run_of(3, 3), *terminal);
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  terminal.reset();
  reader.join();
  EXPECT_EQ(read.frames, 600u);
  EXPECT_GE(seconds, 1.0);
  EXPECT_LT(seconds, 2.5);  // on a busy machine; without the factor it would be 3
}

// Without a reader the gyro's time continues as on a real line.
TEST(TerminalRun, ContinuesWithoutAReaderIfPaced) {
  auto terminal = PseudoTerminal::open("");
  ASSERT_TRUE(terminal);
  SimOptions options = run_of(50, 100);
  options.wait = false;
  const auto begin = Clock::now();
  EXPECT_EQ(run(options, *terminal).frames, 10'000u);
  EXPECT_LT(Clock::now() - begin, milliseconds(5000));
}

TEST(PseudoTerminal, LinksAndUnlinksItsPath) {
  if (test::emulated()) GTEST_SKIP() << "qemu-user has no termios2 (emulator)";
  const test::TemporaryFolder folder;
  const std::string link = folder.file("gyro");
  fs::create_symlink("/dev/pts/none", link);  // left by a killed run
  {
    auto terminal = PseudoTerminal::open(link);
    ASSERT_TRUE(terminal) << terminal.error().text();
    EXPECT_EQ(fs::read_symlink(link), terminal->path());
    EXPECT_FALSE(terminal->has_reader());
    const Descriptor line(::open(link.c_str(), O_RDWR | O_NOCTTY));
    EXPECT_TRUE(terminal->has_reader());
  }
  EXPECT_FALSE(fs::exists(fs::symlink_status(link)));
  std::ofstream(link) << "precious";
  const auto refused = PseudoTerminal::open(link);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text(), link + ": exists but is not a symbolic link; expected a free name");
  EXPECT_EQ(test::read_file(link), "precious");
}

}  // namespace
}  // namespace prism::prismsim
