// SPDX-License-Identifier: MIT
#include "daemon/reloader.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <optional>

#include "tests/support/daemon_parts.hpp"

namespace prism::daemon {
namespace {

class ReloaderTest : public test::DaemonPartsTest {
 protected:
  std::shared_ptr<Reloader> make(Reloader::Load load) {
    return std::make_shared<Reloader>(
        io_, *disk_,
        Reloader::Parts{std::move(load), parts_->device, [this] { ++reopened_; }, [this] { ++outputs_reopened_; },
                        parts_->events.teller(), [] { return std::string("test"); }});
  }
  /// The outcome of a reload.
  std::string reload(Reloader& reloader) {
    std::string outcome;
    reloader.reload([&](const Result<std::string>& done) { outcome = done ? "done" : done.error().text(); });
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
         outcome.empty() && std::chrono::steady_clock::now() < end;) {
      io_.restart();
      io_.run_for(std::chrono::milliseconds(5));
    }
    return outcome;
  }
  /// Reloads the set-up after a change.
  std::string reload(const std::function<void(pipeline::Setup&)>& change) {
    return reload(*make([setup = setup_, change]() mutable {
      change(setup);
      return setup;
    }));
  }

  boost::asio::io_context io_;
  std::optional<DiskThread> disk_{std::in_place, 1 << 20, [](const std::string&) {}};
  int reopened_ = 0, outputs_reopened_ = 0;
};

TEST_F(ReloaderTest, TakesOverWhatWasLoaded) {
  EXPECT_EQ(reload([](auto& setup) { setup.axes[0].engine.max_bias_deg_per_h = 7; }), "done");
  EXPECT_EQ(parts_->device.setup.axes[0].engine.max_bias_deg_per_h, 7);
  EXPECT_EQ(reopened_, 0);
  EXPECT_EQ(outputs_reopened_, 0);
  const socket::Event& event = parts_->events.recent().back();
  EXPECT_EQ(event.kind, "reloaded");
  EXPECT_EQ(event.severity, pipeline::Severity::kInfo);
  EXPECT_EQ(event.text, "reloaded: " + folder_.file("gyro.json") + " in use, model none");
}

// The files may have changed again since it began: those that come meanwhile share one more reload.
TEST_F(ReloaderTest, RequestsDuringAReloadStartOneMore) {
  int loads = 0;
  const auto reloader = make([&]() -> Result<pipeline::Setup> { return ++loads, setup_; });
  std::vector<std::string> outcomes;
  for (int i = 0; i < 3; ++i)
    reloader->reload([&](const Result<std::string>& done) { outcomes.push_back(done ? *done : done.error().text()); });
  EXPECT_EQ(reload(*reloader), "done");
  EXPECT_EQ(loads, 2);
  EXPECT_EQ(outcomes, std::vector<std::string>(3, folder_.file("gyro.json") + " in use, model none"));
}

TEST_F(ReloaderTest, WarnsOfARemovedKey) {
  EXPECT_EQ(reload([](auto& setup) { setup.config.removed_keys = {"gyro.json:/old: removed"}; }), "done");
  const socket::Event& event = parts_->events.recent().front();
  EXPECT_EQ(event.kind, "removed_key");
  EXPECT_EQ(event.text, "gyro.json:/old: removed");
  EXPECT_EQ(event.severity, pipeline::Severity::kWarning);
}

TEST_F(ReloaderTest, ARefusalLeavesEverything) {
  EXPECT_EQ(reload(*make([]() -> Result<pipeline::Setup> { return make_error("gyro.json", "is bad"); })),
            "gyro.json: is bad");
  const socket::Event& event = parts_->events.recent().back();
  EXPECT_EQ(event.kind, "reload_refused");
  EXPECT_EQ(event.severity, pipeline::Severity::kError);
  EXPECT_EQ(event.text, "reload failed, the old configuration stays in use: gyro.json: is bad");
}

// A load that throws on the disk thread is answered, and the next one is not kept waiting for it.
TEST_F(ReloaderTest, ALoadThatThrowsIsARefusal) {
  const auto reloader = make([]() -> Result<pipeline::Setup> { throw std::runtime_error("stale file handle"); });
  for (int i = 0; i < 2; ++i) EXPECT_EQ(reload(*reloader), "reload: stale file handle");
}

TEST_F(ReloaderTest, AnotherLineIsOpenedAnew) {
  EXPECT_EQ(reload([](auto& setup) { setup.line.format.baud = 9600; }), "done");
  EXPECT_EQ(reopened_, 1);
}

// Frames of another speed are the device's, and those of an output that sends "same".
TEST_F(ReloaderTest, AnOutputOfAnotherFormatIsOpenedAnew) {
  setup_.config.outputs = {{.frames = "same"}};
  setup_.outputs = {{setup_.config.outputs[0], nullptr, {}}};
  const auto opened = [&](int baud) {
    EXPECT_EQ(reload([baud](auto& setup) { setup.outputs[0].line.format.baud = baud; }), "done");
    return outputs_reopened_;
  };
  EXPECT_EQ(opened(115200), 1);
  EXPECT_EQ(opened(115200), 1) << "nothing changed";
  EXPECT_EQ(opened(9600), 2);
}

TEST_F(ReloaderTest, AnotherExtrapolationTakesEffect) {
  begin_session();
  feed(2);
  EXPECT_EQ(reload([](auto& setup) { setup.axes[0].engine.extrapolation = compensation::Extrapolation::kClamp; }),
            "done");
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
