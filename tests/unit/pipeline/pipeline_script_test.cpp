// SPDX-License-Identifier: MIT
// Parts of the pipeline as scripts: configurations, problems of an axis, stages without output, sensor lines.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "compensation/plausibility.hpp"
#include "daemon/pipeline/captures.hpp"
#include "daemon/pipeline/device.hpp"
#include "daemon/pipeline/setup.hpp"
#include "daemon/pipeline/stored_segments.hpp"
#include "daemon/pipeline/stream_watch.hpp"
#include "tests/support/blocks.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"

namespace prism::pipeline {
namespace {

using test::next;
using test::rest_of;
using Lines = std::vector<std::string>;

constexpr std::int64_t kBegin_ns = 1'700'000'000'000'000'000;

TEST(Setup, AcceptsOrRefusesAConfiguration) {
  for (const test::Block& block : test::blocks("pipeline/setups.txt", 2)) {
    const test::TemporaryFolder folder;
    std::ofstream(folder.file("g.json")) << block[0];
    const auto setup = load_setup(folder.file("g.json"));
    std::string found = setup ? "good" : setup.error().text();
    if (found.starts_with(folder.file(""))) found.erase(0, folder.file("").size());
    EXPECT_TRUE(found.ends_with(block[1])) << block.where << ": found " << found;
  }
}

TEST(Setup, SaysHowFastItsFilesGrowAndWhichUnitRunsIt) {
  const test::TemporaryFolder folder;
  const auto load = [&](const std::string& text) {
    std::ofstream(folder.file("g.json")) << text;
    return load_setup(folder.file("g.json")).value();
  };
  const auto one = load(R"({"frames": "trplg", "line": {"device": "/dev/null"}})");
  EXPECT_EQ(log_bytes_per_day(one), 86400 * 170);
  EXPECT_EQ(capture_bytes_per_day(one), 86400 * one.frames->rate_hz * (28 + one.frames->max_frame_bytes));
  EXPECT_EQ(unit_name(one), "prismd@g");
  const auto three = load(R"({"frames": "dmu11", "line": {"device": "/dev/null"}, "axes": {"x": {}, "y": {}, "z": {}},
      "sensor_lines": {"room": {"tcp": {"address": "127.0.0.1:4001"}, "columns": {"t": {"column": 1, "unit": "degC"}}}}})");
  EXPECT_EQ(log_bytes_per_day(three), 3 * 86400 * 180);
  EXPECT_EQ(unit_name(three), "prismd-net@g");
  const auto out = load(R"({"frames": "trplg", "line": {"device": "/dev/null"},
      "out": [{"line": {"tcp": {"listen": "127.0.0.1:4001"}}, "frames": "prism", "when_unknown": "drop"}]})");
  EXPECT_EQ(unit_name(out), "prismd-net@g");
}

TEST(Setup, SaysWhyADirectoryCannotBeWritten) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("g.json");
  std::ofstream(file) << "{}";
  EXPECT_EQ(directory_problem(folder.file("")), "");
  EXPECT_EQ(directory_problem(folder.file("log/deep")), "");
  EXPECT_EQ(directory_problem(file), file + ": cannot be written: it is not a directory");
  EXPECT_EQ(directory_problem(file + "/log"), file + "/log: cannot be created: " + file + " is not a directory");
  EXPECT_EQ(directory_problem("/proc/log"), "/proc/log: cannot be created: /proc is a file system without storage");
}

/// "position TEXT", "supersedes TEXT", "cursor TEXT", "name EXTENSION FILE": the parts that are read. "index LINES": an
/// index of 0.3. "written NUMBER BEGIN_S RUNNING_S": names and the header line of a segment.
class StoredPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    const auto extension = command == "name" ? next<std::string>(words) : "";
    const std::string text = rest_of(words);
    if (command == "cursor") {
      const auto found = RowCursor::parse(text);
      EXPECT_EQ(found ? found->text() : text, text);
      return {found ? fmt::format("segment {} row {} total {}", found->segment, found->row, found->total) : "refused"};
    }
    if (command == "position") {
      const auto found = LogPosition::parse(text);
      return {found ? fmt::format("segment {} first {} running {}", found->segment, found->first, found->running_s)
                    : "refused"};
    }
    if (command == "supersedes") {
      const auto found = SupersededRows::parse(text);
      return {found ? fmt::format("{} from {}", found->file, found->row) : "refused"};
    }
    if (command == "name") {
      const auto found = SegmentName::parse(text, "gyro", extension);
      return {found ? fmt::format("number {} begin {} same {} running {}", found->number, found->begin_s, found->same,
                                  found->running_s)
                    : "refused"};
    }
    if (command == "written") {
      SegmentName segment;
      std::istringstream(text) >> segment.number >> segment.begin_s >> segment.running_s;
      const std::string line = LogPosition{std::string(32, 'a'), segment.number, 7, segment.running_s}.line();
      return {segment.file("gyro", ".csv"), segment.file("gyro", ".pcap"), line.substr(0, line.size() - 1)};
    }
    std::ofstream(folder_.file("index")) << text;
    const auto index = OldIndex::read(folder_.file("index"));
    if (!index) return {"refused"};
    Lines given = {fmt::format("id {}, next {}, deleted {} rows, clock {}", index->id, index->next, index->deleted_rows,
                               index->clock_s)};
    for (const auto& [number, entry] : index->entries) {
      given.push_back(fmt::format("{} {}: {} rows, clock {}", number, entry.file, entry.rows, entry.clock_s));
    }
    return given;
  }

 private:
  test::TemporaryFolder folder_;
};

TEST(StoredSegments, Scripts) { test::expect_scripts<StoredPlayer>("pipeline/stored_segments.txt"); }

/// Collects what is reported: "+ KIND: TEXT" when a problem begins, "- KIND: TEXT" when it ends.
class Reports {
 public:
  Lines taken() { return std::exchange(lines_, {}); }
  Problems problems{[this](bool begins, const std::string& kind, const std::string& text) {
    lines_.push_back((begins ? "+ " : "- ") + kind + ": " + text);
  }};

 private:
  Lines lines_;
};

/// Rows of an axis with a sensor "case".
class AxisPlayer {
 public:
  AxisPlayer() { axis_.prefix = "z: "; }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "reload") {
      axis_.changes.forget();
      reports_.problems.clear_all("question", "ended: ");
      return reports_.taken();
    }
    next<std::string>(words);
    const auto degc = next<std::string>(words);
    const auto case_degc = next(words, 20.0), rate_deg_per_h = next(words, 8.0);
    for (int i = 0; i < std::stoi(command); ++i) {
      const double wave = std::sin(static_cast<double>(++second_));
      compensation::CompensatedWindow row;
      compensation::SecondMean& mean = row.window.second_mean;
      mean.second = second_;
      mean.sensor_list = list_;
      mean.sensors = {case_degc};
      mean.rate_deg_per_h = rate_deg_per_h + 0.1 * wave;
      mean.temperature_degc = degc == "unknown" ? kUnknown : std::stod(degc) + (degc.ends_with('~') ? 0.001 * wave : 0);
      mean.implausible.rate = !rate_.check(mean.rate_deg_per_h, second_ * 1'000'000'000);
      mean.implausible.temperature =
          degc != "unknown" && !temperature_.check(mean.temperature_degc, second_ * 1'000'000'000);
      mean.all_implausible = mean.implausible;
      row.rejections = {rate_.rejection(), temperature_.rejection(), {}};
      axis_.watch(
          row, [](auto, auto&, auto&) {}, reports_.problems);
    }
    return reports_.taken();
  }

 private:
  Reports reports_;
  AxisRecord axis_;
  compensation::SensorCheck rate_{compensation::PlausibilityLimits().rate};
  compensation::SensorCheck temperature_{compensation::PlausibilityLimits().temperature};
  SensorList list_ = std::make_shared<const std::vector<SensorName>>(std::vector<SensorName>{{"case", "degC"}});
  std::int64_t second_ = 1'795'425'060;
};

TEST(AxisRecord, Scripts) { test::expect_scripts<AxisPlayer>("pipeline/axis_record.txt"); }

/// Lines at 10 Hz with a rate in column 1 and a tag in column 0.
class StagePlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "described") {  // TYPE of the tag, and more of the gyro and of the message type
      const auto type = next<std::string>(words), gyro = next<std::string>(words);
      std::ofstream(folder_.file("lines.json")) << fmt::format(
          R"({{"format": "prism-frames", "version": 1, "name": "lines", "line": {{"baud": 9600}}, "rate_hz": 10,
          "kinds": [{{"name": "data", "length": {{"terminator": "0D 0A", "min": 6, "max": 40}}, "text": {{"separators": " "}},
          "fields": {{"tag": {{"column": 0, "type": "{}"}}, "rate": {{"column": 1, "type": "decimal", "unit": "deg/h"}}}} {}}}],
          "gyro": {{"meaning": "rate", "unit": "deg/h", "axes": {{"z": "rate"}}}} {}}})",
          type, rest_of(words),
          gyro == "tagged" ? R"(, "counter": {"field": "tag", "modulus": 1000000, "ticks_per_s": 1000})" : "");
      std::ofstream(folder_.file("gyro.json")) << R"({"frames": ")" << folder_.file("lines.json")
                                               << R"(", "line": {"device": "/dev/null"}, "socket": {"path": ""}})";
      const auto setup = load_setup(folder_.file("gyro.json"));
      EXPECT_TRUE(setup) << setup.error().text();
      pipeline_.emplace(*setup);
    } else if (command == "begin") {
      monitor_.begin();
    } else if (command == "skip") {
      now_ns_ += 1'000'000'000 * next<std::int64_t>(words);
    } else if (command == "refused") {
      return {std::to_string(pipeline_->decoder().counters().refused)};
    } else {  // SECONDS x TEXT each 0.1 s; # is the time in ms
      next<std::string>(words);
      const std::string text = rest_of(words);
      for (int i = 0; i < 10 * std::stoi(command); ++i, ++number_) {
        std::string line = text + "\r\n";
        if (const auto at = line.find('#'); at != std::string::npos) line.replace(at, 1, std::to_string(100 * number_));
        now_ns_ += 100'000'000;
        pipeline_->feed({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()}, now_ns_);
        if (i % 10 != 9) continue;
        const std::string problem = monitor_.push(*pipeline_, now_ns_);
        problem.empty() ? reports_.problems.clear("no_rate", "over")
                        : reports_.problems.set("no_rate", {.kind = "no_rate", .text = problem});
      }
    }
    return reports_.taken();
  }

 private:
  test::TemporaryFolder folder_;
  Reports reports_;
  std::optional<Pipeline> pipeline_;
  StageMonitor monitor_;
  std::int64_t now_ns_ = kBegin_ns;
  int number_ = 0;
};

TEST(StageMonitor, Scripts) { test::expect_scripts<StagePlayer>("pipeline/stage_monitor.txt"); }

/// A sensor line "chamber" with a thermometer, and its captures. Times are seconds.
class SensorLinePlayer {
 public:
  SensorLinePlayer() {
    std::ofstream(folder_.file("gyro.json"))
        << R"({"frames": "trplg", "line": {"device": "/dev/null"}, "socket": {"path": ""}, "axes": {"z": {"temperature":
        "chamber.t"}}, "sensor_lines": {"chamber": {"device": "/dev/zero", "stale_after_s": 3, "columns": {"t": {"column": 1,
        "unit": "degC"}}}}})";
    setup_ = load_setup(folder_.file("gyro.json")).value();
    feed_.emplace(setup_.sensor_lines.front());
  }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "received") {  // VALUE at TIME
      const auto value = next<double>(words);
      feed_->feed(line_of(value), time_ns(next<double>(words)), kBegin_ns, time_ns(100));
    } else if (command == "value") {  // at TIME
      double value = 0;
      feed_->values_at(time_ns(next<double>(words)), {&value, 1});
      return {std::isnan(value) ? "unknown" : fmt::format("{:g}", value)};
    } else if (command == "session") {  // at TIME
      feed_->begin_session(time_ns(next<double>(words)));
    } else if (command == "capture") {  // FILE with packets at these times; |N: the line was opened
      const auto file = folder_.file(next<std::string>(words));
      auto writer = drivers::CaptureWriter::open(file);
      for (std::string word; words >> word;) {
        const bool opened = word.starts_with('|');
        const std::int64_t at = time_ns(std::stod(word.substr(opened ? 1 : 0)));
        EXPECT_TRUE(opened ? writer->opened(at) : writer->data(at, line_of(20)));
      }
      EXPECT_TRUE(writer->flush());
      files_["chamber"].push_back(file);
    } else if (command == "no_file") {
      files_["chamber"] = {folder_.file(next<std::string>(words))};
    } else if (command == "merged") {  // with packets of the gyro: all in order, "s" of the sensors, "g" of the gyro
      auto captures = SensorCaptures::open(setup_, files_);
      if (!captures) return {captures.error().text().substr(folder_.file("").size())};
      Lines given;
      std::string order;
      const auto add = [&](const char* of, const drivers::CapturePacket& packet) {
        const bool opened = packet.event == drivers::CaptureEvent::kOpened;
        order += fmt::format("{}{}{}{}", order.empty() ? "" : " ", opened ? "|" : "", of,
                             (packet.time_ns - kBegin_ns) / 1'000'000'000);
      };
      for (std::string word; words >> word;) {
        const bool opened = word.starts_with('|');
        const drivers::CapturePacket packet{time_ns(std::stod(word.substr(opened ? 1 : 0))),
                                            opened ? drivers::CaptureEvent::kOpened : drivers::CaptureEvent::kData,
                                            {}};
        captures->until(packet, [&](std::size_t, const drivers::CapturePacket& sensors) { add("s", sensors); });
        add("g", packet);
      }
      given = captures->notes();
      given.push_back(order);
      return given;
    }
    return {};
  }

 private:
  static std::int64_t time_ns(double second) { return kBegin_ns + std::llround(1e9 * second); }
  static std::vector<std::uint8_t> line_of(double celsius) {
    const std::string text = std::to_string(celsius) + "\r\n";
    return {text.begin(), text.end()};
  }

  test::TemporaryFolder folder_;
  Setup setup_;
  std::optional<SensorFeed> feed_;
  SensorFiles files_;
};

TEST(SensorLines, Scripts) { test::expect_scripts<SensorLinePlayer>("pipeline/sensor_lines.txt"); }

}  // namespace
}  // namespace prism::pipeline
