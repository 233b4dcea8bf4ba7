// SPDX-License-Identifier: MIT
// Clients get a row when it is written, or when the disk is late.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/support/daemon_parts.hpp"

namespace prism::socket {
namespace {

// A disk that writes rows when the test requests it.
struct WaitingWriter : pipeline::RowWriter {
  void append(const compensation::CompensatedWindow&, std::int64_t) override { ++waiting.pending; }
  void sync() override {}
  void set_metadata(const std::string&) override {}
  void read(const pipeline::RowQuery&, Pages) override {}
  void close() override {}
  const pipeline::LogCounters& counters() const override { return waiting; }
  pipeline::LogCounters waiting;
};

class HeldRows : public test::DaemonPartsTest {
 protected:
  HeldRows() {
    auto writer = std::make_unique<WaitingWriter>();
    writer_ = writer.get();
    std::vector<std::unique_ptr<pipeline::RowWriter>> logs;
    logs.push_back(std::move(writer));
    parts_ = std::make_unique<test::DaemonParts>(setup_, std::move(logs));
    listener_.client()->subscription.windows = true;
    parts_->publisher.add(listener_.client());
    begin_session();
  }
  ~HeldRows() override { parts_->publisher.remove(listener_.client().get()); }

  void written() {
    writer_->waiting.pending = 0;
    parts_->publisher.rows_written();
  }
  std::ptrdiff_t heard() {
    const std::string text = listener_.read();
    return std::count(text.begin(), text.end(), '\n');
  }

  WaitingWriter* writer_;
  test::Asker listener_;
};

TEST_F(HeldRows, AWindowIsToldOnceItIsWritten) {
  feed(3);
  const auto rows = static_cast<std::ptrdiff_t>(writer_->waiting.pending);
  ASSERT_GT(rows, 0);
  EXPECT_EQ(heard(), 0);
  parts_->publisher.release_late();  // seen once: it may be a moment old
  EXPECT_EQ(heard(), 0);
  written();
  EXPECT_EQ(heard(), rows);
}

TEST_F(HeldRows, ADiskThatHangsHoldsNoClientBackForLong) {
  feed(2);
  parts_->publisher.release_late();
  parts_->publisher.release_late();
  EXPECT_GT(heard(), 0);
  feed(1);
  EXPECT_EQ(heard(), 1);  // at once, while the disk is blocked
  written();
  feed(1);
  EXPECT_EQ(heard(), 0);
  written();
  EXPECT_EQ(heard(), 1);
}

}  // namespace
}  // namespace prism::socket
