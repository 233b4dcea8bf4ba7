// SPDX-License-Identifier: MIT
#include "daemon/reloader.hpp"

#include <gtest/gtest.h>

#include <future>
#include <optional>

#include "tests/support/daemon_parts.hpp"

namespace prism::daemon {
namespace {

class ReloaderTest : public test::DaemonPartsTest {
 protected:
  std::shared_ptr<Reloader> make(Reloader::Load load) {
    return Reloader::make(io_, *disk_,
                          {std::move(load), parts_->device, [this] { ++reopened_; }, [this] { ++outputs_reopened_; },
                           parts_->events.teller(), [] { return std::string("test"); }});
  }
  void run_until(const bool& done) {
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
         !done && std::chrono::steady_clock::now() < end;) {
      io_.restart();
      io_.run_for(std::chrono::milliseconds(5));
    }
    ASSERT_TRUE(done);
  }

  boost::asio::io_context io_;
  std::optional<DiskThread> disk_{std::in_place, 1 << 20, [](const std::string&) {}};
  int reopened_ = 0, outputs_reopened_ = 0;
};

TEST_F(ReloaderTest, TakesOverWhatWasLoaded) {
  const auto reloader = make([this] {
    pipeline::Setup setup = setup_;
    setup.axes[0].engine.max_bias_deg_per_h = 7;
    return setup;
  });
  bool done = false;
  reloader->reload([&](const Result<std::string>& outcome) { done = outcome.has_value(); });
  run_until(done);
  EXPECT_EQ(parts_->device.setup.axes[0].engine.max_bias_deg_per_h, 7);
  EXPECT_EQ(reopened_, 0);
}

TEST_F(ReloaderTest, WarnsOfARemovedKey) {
  const auto reloader = make([this] {
    pipeline::Setup setup = setup_;
    setup.config.removed_keys = {"gyro.json:/old: removed"};
    return setup;
  });
  bool done = false;
  reloader->reload([&](const Result<std::string>& outcome) { done = outcome.has_value(); });
  run_until(done);
  const socket::Event& event = parts_->events.recent().front();
  EXPECT_EQ(event.kind, "removed_key");
  EXPECT_EQ(event.text, "gyro.json:/old: removed");
  EXPECT_EQ(event.severity, pipeline::Severity::kWarning);
}

TEST_F(ReloaderTest, ARefusalLeavesEverything) {
  const auto reloader = make([]() -> Result<pipeline::Setup> { return make_error("gyro.json", "is bad"); });
  bool done = false;
  reloader->reload([&](const Result<std::string>& outcome) {
    EXPECT_EQ(outcome.error().text(), "gyro.json: is bad");
    done = true;
  });
  run_until(done);
  EXPECT_EQ(parts_->events.recent().back().kind, "reload_refused");
}

// A load that throws on the disk thread is answered, and the next one is not kept waiting for it.
TEST_F(ReloaderTest, ALoadThatThrowsIsARefusal) {
  const auto reloader = make([]() -> Result<pipeline::Setup> { throw std::runtime_error("stale file handle"); });
  for (int i = 0; i < 2; ++i) {
    bool done = false;
    reloader->reload([&](const Result<std::string>& outcome) {
      EXPECT_EQ(outcome.error().text(), "reload: stale file handle");
      done = true;
    });
    run_until(done);
  }
}

TEST_F(ReloaderTest, AnotherLineIsOpenedAnew) {
  const auto reloader = make([this] {
    pipeline::Setup setup = setup_;
    setup.line.format.baud = 9600;
    return setup;
  });
  bool done = false;
  reloader->reload([&](const auto&) { done = true; });
  run_until(done);
  EXPECT_EQ(reopened_, 1);
}

// Frames of another speed are the device's, and those of an output that sends "same".
TEST_F(ReloaderTest, AnOutputOfAnotherFormatIsOpenedAnew) {
  pipeline::Setup setup = setup_;
  setup.config.outputs = {{.frames = "same"}};
  setup.outputs = {{setup.config.outputs[0], nullptr, {}}};
  const auto reloader = make([&setup] { return setup; });
  const auto reload = [&] {
    bool done = false;
    reloader->reload([&](const auto&) { done = true; });
    run_until(done);
    return outputs_reopened_;
  };
  EXPECT_EQ(reload(), 1);
  EXPECT_EQ(reload(), 1) << "nothing changed";
  setup.outputs[0].line.format.baud = 9600;
  EXPECT_EQ(reload(), 2);
}

TEST_F(ReloaderTest, AnotherExtrapolationTakesEffect) {
  const auto reloader = make([this] {
    pipeline::Setup setup = setup_;
    setup.axes[0].engine.extrapolation = compensation::Extrapolation::kClamp;
    return setup;
  });
  begin_session();
  feed(2);
  bool done = false;
  reloader->reload([&](const auto&) { done = true; });
  run_until(done);
  EXPECT_EQ(parts_->device.pipeline->decoder().counters().frames, 0u);  // a pipeline of its own
  EXPECT_GT(parts_->device.frames(), 0u);
}

// SIGHUP, then SIGTERM: the disk thread still read the configuration for a reloader that was gone.
TEST_F(ReloaderTest, MayEndWhileTheDiskThreadStillLoads) {
  std::promise<void> begun, go_on;
  auto reloader = make([&, setup = setup_]() -> Result<pipeline::Setup> {
    begun.set_value();
    go_on.get_future().wait();
    return setup;
  });
  bool called = false;
  reloader->reload([&](const auto&) { called = true; });
  begun.get_future().wait();
  reloader.reset();
  parts_.reset();
  go_on.set_value();
  disk_.reset();
  io_.restart();
  io_.poll();
  EXPECT_FALSE(called);
}

}  // namespace
}  // namespace prism::daemon
