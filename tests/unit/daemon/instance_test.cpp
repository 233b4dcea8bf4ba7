// SPDX-License-Identifier: MIT
// When clients are told a second's row: once the disk has it, or once the disk is late.
#include "daemon/instance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/unit/daemon/instance_fixture.hpp"

namespace prism::daemon {
namespace {

// A disk that takes rows when the test says so.
struct WaitingWriter : RowWriter {
  void append(const compensation::CompensatedWindow&, std::int64_t) override { ++waiting.pending; }
  void sync() override {}
  void set_metadata(const std::string&) override {}
  void read(const RowQuery&, Pages) override {}
  void close() override {}
  const LogCounters& counters() const override { return waiting; }
  LogCounters waiting;
};

class InstanceTest : public test::InstanceFixture {
 protected:
  InstanceTest() {
    auto writer = std::make_unique<WaitingWriter>();
    writer_ = writer.get();
    std::vector<std::unique_ptr<RowWriter>> logs;
    logs.push_back(std::move(writer));
    instance_ = std::make_unique<Instance>(setup_, std::move(logs), nullptr, [](const Event&) {});
    listener_.client()->subscription.windows = true;
    instance_->publisher.add(listener_.client());
    begin_session();
  }
  ~InstanceTest() override { instance_->publisher.remove(listener_.client().get()); }

  void written() {
    writer_->waiting.pending = 0;
    instance_->rows_written();
  }
  std::ptrdiff_t heard() {
    const std::string text = listener_.read();
    return std::count(text.begin(), text.end(), '\n');
  }

  WaitingWriter* writer_;
  test::Asker listener_;
};

TEST_F(InstanceTest, AWindowIsToldOnceItIsWritten) {
  feed(3);
  const auto rows = static_cast<std::ptrdiff_t>(writer_->waiting.pending);
  ASSERT_GT(rows, 0);
  EXPECT_EQ(heard(), 0);
  instance_->release_late();  // seen once: it may be a moment old
  EXPECT_EQ(heard(), 0);
  written();
  EXPECT_EQ(heard(), rows);
}

TEST_F(InstanceTest, ADiskThatHangsHoldsNoClientBackForLong) {
  feed(2);
  instance_->release_late();
  instance_->release_late();
  EXPECT_GT(heard(), 0);
  feed(1);
  EXPECT_EQ(heard(), 1);  // at once, as long as the disk hangs
  written();
  feed(1);
  EXPECT_EQ(heard(), 0);
  written();
  EXPECT_EQ(heard(), 1);
}

}  // namespace
}  // namespace prism::daemon
