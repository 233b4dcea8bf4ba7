// SPDX-License-Identifier: MIT
// Logs and captures as scripts: the files, reports and pages after writes, disk errors, damage and restarts.
// restarts.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/fsuid.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <future>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>

#include "base/file.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "daemon/log/capture_log.hpp"
#include "daemon/log/row_log.hpp"
#include "drivers/capture_file.hpp"
#include "tests/support/disk_files.hpp"
#include "tests/support/scripts.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/log/failing_calls.hpp"

namespace prism::log {
namespace {

namespace fs = std::filesystem;
using test::next;
using test::rest_of;
using Lines = std::vector<std::string>;

constexpr std::int64_t kNoon = 1'795'262'400;  // 2026-11-21T12:00:00Z
constexpr uid_t kNobody = 65534;

// "12:00:00" of 2026-11-21, else the complete time.
std::string short_time(const std::string& utc) {
  return utc.starts_with("2026-11-21T") ? utc.substr(11, 8) : utc.substr(0, 19);
}

// Seconds after noon of 2026-11-21, or since 1970 with an @.
std::int64_t second_of(const std::string& word) {
  return word.starts_with('@') ? std::stoll(word.substr(1)) : kNoon + std::stoll(word);
}

/// A disk: how a script changes it or lets it fail, and the lines that are reported.
class DiskPlayer {
 public:
  virtual ~DiskPlayer() {
    ::setfsuid(::geteuid());
    if (stdin_.get() >= 0) ::dup2(stdin_.get(), STDIN_FILENO);
  }

  Lines play(const std::string& command, std::istream& words) {
    given_.clear();
    if (!of_disk(command, words) && !of_log(command, words)) give("unknown command");
    for (const Lines all = told_.lines(); shown_ < std::ssize(all);) {
      const auto same = std::find_if(all.begin() + shown_, all.end(),
                                     [&](auto& line) { return line != all[static_cast<std::size_t>(shown_)]; });
      const auto count = same - all.begin() - shown_;
      give((count > 1 ? fmt::format("{} times ", count) : "") + all[static_cast<std::size_t>(shown_)]);
      shown_ += count;
    }
    return std::move(given_);
  }

 protected:
  virtual bool of_log(const std::string& command, std::istream& words) = 0;

  template <class... Parts>
  void give(fmt::format_string<Parts...> form, Parts&&... parts) {
    give(std::string(fmt::format(form, std::forward<Parts>(parts)...)));
  }
  void give(std::string line) {
    for (std::size_t at; (at = line.find(folder_.file(""))) != std::string::npos;)
      line.erase(at, folder_.file("").size());
    given_.push_back(std::regex_replace(line, std::regex("n{250}|d{300}"), "LONG"));
  }
  std::string path(const std::string& file) const {
    return file == "." ? settings_.directory : settings_.directory + "/" + file;
  }
  // A clock of its own.
  SegmentPolicy policy(std::int64_t notice_s) {
    const auto tell = [tell = told_.teller()](pipeline::Severity, const std::string& kind, const std::string& text) {
      tell(kind + ": " + text);
    };
    return {tell, true, notice_s, [this] { return uptime_s_; }};
  }

  const test::TemporaryFolder folder_;
  config::LogSegmentSettings settings_ = test::segments_in(folder_.file("log"));
  test::Told told_;
  std::string name_ = "gyro";
  std::int64_t uptime_s_ = 0;

 private:
  bool of_disk(const std::string& command, std::istream& words) {
    if (command == "set") {
      const auto key = next<std::string>(words);
      const auto value = next<std::int64_t>(words, 1);
      if (key == "max_bytes") settings_.max_bytes = value;
      if (key == "max_age_s") settings_.max_age_s = value;
      if (key == "keep_bytes") settings_.keep_bytes = value;
      if (key == "keep_days") settings_.keep_days = static_cast<int>(value);
      if (key == "delete_when_full") settings_.delete_when_full = true;
    } else if (command == "fail") {
      static std::map<std::string, std::atomic<int>*> calls = {{"write", &test::failing_write},
                                                               {"fdatasync", &test::failing_fdatasync},
                                                               {"ftruncate", &test::failing_ftruncate},
                                                               {"readdir", &test::failing_readdir}};
      const auto call = next<std::string>(words);
      const int error = next<std::string>(words) == "ENOSPC" ? ENOSPC : EIO;
      test::writable_bytes = test::readable_entries = next<long>(words);
      faults_.push_back(std::make_unique<test::FailingCall>(*calls.at(call), error, next<int>(words, INT_MAX)));
    } else if (command == "works") {
      faults_.clear();
    } else if (command == "name") {
      name_ = rest_of(words);
    } else if (command == "directory") {
      settings_.directory += "/" + rest_of(words);
    } else if (command == "file") {
      const auto name = next<std::string>(words);
      if (name != ".") fs::create_directories(settings_.directory);
      test::write_file(path(name), rest_of(words));
    } else if (command == "link") {
      fs::create_directories(settings_.directory);
      fs::create_symlink(folder_.file("target"), path(next<std::string>(words)));
    } else if (command == "mkdir") {
      fs::create_directories(path(next<std::string>(words)));
    } else if (command == "append_to") {
      const auto name = next<std::string>(words);
      std::ofstream(path(name), std::ios::app) << rest_of(words);
    } else if (command == "move") {
      const auto from = next<std::string>(words);
      fs::rename(path(from), path(next<std::string>(words)));
    } else if (command == "remove") {
      const auto name = next<std::string>(words);
      if (name == "*")
        for (const auto& file : test::files_in(settings_.directory)) fs::remove(path(file));
      else
        fs::remove_all(path(name));
    } else if (command == "edit") {  // FILE EXPRESSION TEXT
      const auto name = next<std::string>(words);
      const std::regex old(next<std::string>(words));
      test::write_file(path(name), std::regex_replace(test::content(path(name)), old, rest_of(words)));
    } else if (command == "files") {
      for (const auto& file : test::files_in(settings_.directory)) give(file);
      if (fs::exists(folder_.file("target"))) give("target");
    } else if (command == "no_rights") {
      // root has all rights: this thread takes those of the user nobody (plain-ok: user name)
      fs::create_directories(settings_.directory);
      fs::permissions(folder_.file(""), fs::perms::all);
      fs::permissions(settings_.directory, fs::perms::none);
      if (::geteuid() == 0) ::setfsuid(kNobody);
    } else if (command == "no_stdin") {  // the next file that is opened has the descriptor 0
      stdin_.reset(::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3));
      ::close(STDIN_FILENO);
    } else if (command == "rights") {
      ::setfsuid(::geteuid());
      fs::permissions(settings_.directory, fs::perms::owner_all);
    } else {
      return false;
    }
    return true;
  }

  std::vector<std::unique_ptr<test::FailingCall>> faults_;
  Descriptor stdin_;
  Lines given_;
  std::ptrdiff_t shown_ = 0;
};

/// A log, its files and its clients, which read it from a cursor.
class RowLogPlayer : public DiskPlayer {
 public:
  RowLogPlayer() { open(); }

 private:
  void open() {
    log_.reset();
    log_ = std::make_unique<RowLog>(settings_, name_, metadata_, counters_, told_.problems, policy(60));
  }
  bool of_log(const std::string& command, std::istream& words) override {
    if (command == "open") {
      open();
    } else if (command == "append") {
      for (int left = next(words, 1); left > 0; --left) log_->append(test::row_at(second_++), session_ns_);
    } else if (command == "sync") {
      for (int left = next(words, 1); left > 0; --left) log_->sync();
    } else if (command == "synced") {  // one by one
      for (int left = next(words, 1); left > 0; --left)
        log_->append(test::row_at(second_++), session_ns_), log_->sync();
    } else if (command == "metadata") {
      log_->set_metadata(metadata_ = rest_of(words) + "\n");
    } else if (command == "session") {
      session_ns_ = 1'000'000'000 * next<std::int64_t>(words);
    } else if (command == "at") {
      second_ = second_of(next<std::string>(words));
    } else if (command == "lose") {
      log_->lose(rest_of(words));
    } else if (command == "close") {
      log_.reset();
    } else if (command == "counters") {
      give("rows {}, dropped {}, unsynced {}, segments {}{}", counters_.rows.load(), counters_.dropped.load(),
           counters_.unsynced.load(), counters_.segments.load(),
           counters_.gone > 0 ? fmt::format(", gone {}", counters_.gone.load()) : "");
    } else if (command == "show") {
      for (const auto& file : test::files_in(settings_.directory)) show(file);
    } else if (command == "client") {
      const auto name = next<std::string>(words);
      clients_[name] = next<std::string>(words, "earliest");
    } else if (command == "read") {
      const auto name = next<std::string>(words);
      give(read(clients_[name], next<std::size_t>(words, 1000)));
    } else if (command == "cursor") {  // of a client
      give(clients_[next<std::string>(words)]);
    } else if (command == "json") {  // NAME LIMIT [header]: a page; the cursor stays
      const auto name = next<std::string>(words);
      const auto limit = next<std::size_t>(words);
      const RowResult page = log_->page({clients_[name], limit, !next<std::string>(words).empty()});
      give(page ? page->json : page.error().text + ": " + page.error().after.text());
    } else if (command == "read_all") {  // by pages of several sizes, twice each, of a log that is opened again
      Lines found;
      for (const std::size_t limit : {1, 3, 7, 1000}) {
        open();
        for (int twice = 0; twice < 2; ++twice) {
          std::string cursor = "earliest", before;
          got_.clear(), missing_ = 0;
          while (cursor != before) before = cursor, read(cursor, limit);
          found.push_back(summary());
          EXPECT_FALSE(log_->page({"latest", 10})->missing);
        }
      }
      for (std::size_t i = 0; i < found.size(); ++i)
        if (i == 0 || found[i] != found[0]) give(found[i]);
    } else if (command == "damage") {
      damage(next<std::string>(words), words);
    } else {
      return false;
    }
    return true;
  }

  // "rows A B": removes these. "bytes A N": cuts the file N bytes after the begin of row A.
  void damage(const std::string& file, std::istream& words) {
    std::string text = test::content(path(file));
    const auto what = next<std::string>(words);
    const auto row = [&text](int number) {
      std::size_t at = text.find("\n20") + 1;
      for (; number > 1; --number) at = text.find('\n', at) + 1;
      return at;
    };
    const std::size_t from = row(next<int>(words));
    if (what == "rows") {
      text.erase(from, row(next<int>(words) + 1) - from);
    } else {
      text.resize(from + next<std::size_t>(words));
    }
    test::write_file(path(file), text);
  }

  void show(const std::string& file) {
    std::string line = file + ":", text = test::content(path(file)), others, first, last;
    const int other = ::open(path(file).c_str(), O_RDONLY | O_CLOEXEC);
    if (::flock(other, LOCK_SH | LOCK_NB) != 0) line += " locked,";
    ::close(other);
    std::istringstream in(text);
    int count = 0;
    const auto end_rows = [&] {
      if (count > 0)
        line += count == 1 ? fmt::format(" row {}", first) : fmt::format(" {} rows {} to {}", count, first, last);
      count = 0;
    };
    for (std::string each; std::getline(in, each);) {
      if (const auto at = each.find(", sha256 "); at != std::string::npos) {
        const bool good = each.substr(at + 9) == sha256_hex(text.substr(0, text.find("# end: ")));
        each = each.substr(0, at) + (good ? "" : " WRONG");
      }
      if (each.starts_with("# log: ") && each.substr(7, 32) == sha256_hex(others).substr(0, 32))
        each.replace(7, 32, "ITS");
      if (each.starts_with("# ")) {
        end_rows();
        line += " " + each.substr(2) + ";";
        others += each + "\n";
      } else if (each.size() > 20 && each[19] == 'Z') {
        last = short_time(each);
        if (count++ == 0) first = last;
      } else if (!each.starts_with("time_utc,")) {
        end_rows();
        line += " torn " + each + ";";
      }
    }
    end_rows();
    give(line);
  }

  // A page of the log; moves the cursor.
  std::string read(std::string& cursor, std::size_t limit) {
    const RowResult page = log_->page({cursor, limit});
    if (!page) {
      if (page.error().gone > 0) cursor = page.error().after.text();
      missing_ += page.error().gone;
      return page.error().text;
    }
    cursor = page->after.text();
    const auto before = std::exchange(missing_, page->missing);
    Lines all;
    all.swap(got_);
    const auto answer = nlohmann::json::parse(page->json + "}");
    for (const auto& segment : answer["segments"])
      for (const std::string row : segment["rows"]) got_.push_back(short_time(row));
    std::string text = summary();
    all.insert(all.end(), got_.begin(), got_.end());
    got_ = std::move(all), missing_ += before;
    return text;
  }
  // "rows 12:00:01 12:00:02, missing 3"
  std::string summary() const {
    std::string text = fmt::format("{} rows", got_.size());
    for (std::size_t i = 0; i < got_.size(); ++i)
      if (i == 0 || i + 1 == got_.size()) text += (i == 0 ? " " : " to ") + got_[i];
    return text + fmt::format(", {} missing", missing_);
  }

  LogCounters counters_;
  std::string metadata_ = "# a: b\n";
  std::int64_t second_ = kNoon, session_ns_ = 1'000'000'001;
  std::unique_ptr<RowLog> log_;
  std::map<std::string, std::string> clients_;
  Lines got_;
  std::uint64_t missing_ = 0;
};

TEST(RowLog, Scripts) { test::expect_scripts<RowLogPlayer>("log/row_log.txt"); }
TEST(LogPager, Scripts) { test::expect_scripts<RowLogPlayer>("log/log_pager.txt"); }

/// A capture. "data 1.5 ab": these bytes at that second. "flushed 0 2 x": at each of the seconds, and on the disk; # is
/// the last digit of the second.
class CapturePlayer : public DiskPlayer {
 public:
  CapturePlayer() { open(CaptureLog::kMostHeld); }
  ~CapturePlayer() override { unblock(); }

 private:
  void open(std::size_t most_held) {
    log_.reset();
    log_ = std::make_unique<CaptureLog>(settings_, name_, disk_, told_.problems, most_held, policy(60));
  }
  void unblock() {
    if (gate_) gate_->set_value();
    gate_.reset();
  }
  void data(double second, const std::string& text, bool is_sent = false) {
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    const std::int64_t time_ns = kNoon * 1'000'000'000 + std::llround(second * 1e9);
    log_->record(is_sent ? drivers::CaptureEvent::kSent : drivers::CaptureEvent::kData, bytes, time_ns);
  }
  bool of_log(const std::string& command, std::istream& words) override {
    if (command == "open") {
      open(next<std::size_t>(words, CaptureLog::kMostHeld));
    } else if (command == "data") {
      const auto second = next<double>(words);
      data(second, rest_of(words));
    } else if (command == "sent") {
      const auto second = next<double>(words);
      data(second, rest_of(words), true);
    } else if (command == "mark") {
      log_->record(drivers::CaptureEvent::kOpened, {}, kNoon * 1'000'000'000 + std::llround(next<double>(words) * 1e9));
    } else if (command == "flush") {
      log_->flush();
    } else if (command == "flushed") {
      const auto from = next<int>(words), to = next<int>(words);
      const std::string text = rest_of(words);
      for (int second = from; second <= to; ++second) {
        data(second, text == "#" ? std::to_string(second % 10) : text);
        log_->flush();
        if (!gate_) disk_.drain();
      }
    } else if (command == "block") {
      gate_.emplace();
      disk_.post(0, [open = gate_->get_future().share()] { open.wait(); });
    } else if (command == "unblock") {
      unblock();
    } else if (command == "close") {
      log_.reset();
    } else if (command == "show") {
      if (!gate_) disk_.drain();
      if (log_) give("dropped {}", log_->dropped_bytes());
      for (const auto& file : test::files_in(settings_.directory)) give("{}: {}", file, packets(file));
      if (fs::exists(folder_.file("target"))) give("target");
    } else {
      return false;
    }
    if (!gate_) disk_.drain();
    return true;
  }
  // "|" is a mark, ">" before bytes that were sent, else the bytes as they are, a repeated one as x*10.
  std::string packets(const std::string& name) const {
    auto reader = drivers::CaptureReader::open(path(name));
    EXPECT_TRUE(reader) << name;
    std::string text, shown;
    while (const auto packet = reader ? reader->next() : std::nullopt) {
      if (packet->event == drivers::CaptureEvent::kOpened) text += '|';
      if (packet->event == drivers::CaptureEvent::kSent) text += '>';
      text.append(packet->bytes.begin(), packet->bytes.end());
    }
    for (std::size_t i = 0, end = 0; i < text.size(); i = end) {
      end = std::min(text.find_first_not_of(text[i], i), text.size());
      shown += end - i > 3 ? fmt::format("{}*{}", text[i], end - i) : text.substr(i, end - i);
    }
    return shown;
  }

  test::Told unanswered_;
  DiskThread disk_{1000, unanswered_.teller()};
  std::unique_ptr<CaptureLog> log_;
  std::optional<std::promise<void>> gate_;
};

TEST(CaptureLog, Scripts) { test::expect_scripts<CapturePlayer>("log/capture_log.txt"); }

/// The segments of a log or capture, on a clock of its own. A made segment has its position, one row, and 'x' up to a
/// size.
class SegmentsPlayer : public DiskPlayer {
 public:
  SegmentsPlayer() { uptime_s_ = 1000; }

 private:
  Segments& segments() {
    if (!segments_) segments_.emplace(settings_, name_, extension_, policy_ ? *policy_ : policy(0));
    return *segments_;
  }
  void make(std::int64_t second, std::size_t bytes, std::uint64_t rows) {
    const Result<NewSegment> segment = segments().make(second);
    if (!segment) return give(segment.error().text());
    std::string text = extension_ == ".csv" ? segments().position_line("# a: b\n") : "";
    text.resize(std::max(text.size(), bytes), 'x');
    EXPECT_EQ(::write(segment->descriptor, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    ::close(segment->descriptor);
    if (extension_ == ".csv") segments().ended(rows);
    give(segment->path.substr(settings_.directory.size() + 1));
  }
  bool of_log(const std::string& command, std::istream& words) override {
    if (command == "open") {  // again, with "notice N" or as a "replay", or a "capture"
      segments_.reset();
      SegmentPolicy made = policy(0);
      for (std::string word; words >> word;) {
        if (word == "notice") made.notice_s = next<std::int64_t>(words);
        if (word == "replay") made.deletes = false;
        if (word == "capture") extension_ = ".pcap";
      }
      policy_ = made;
    } else if (command == "make") {  // SECOND [BYTES [ROWS]]
      const std::int64_t second = second_of(next<std::string>(words));
      const auto bytes = next<std::size_t>(words);
      make(second, bytes, next<std::uint64_t>(words, 1));
    } else if (command == "unmake") {
      ::close(segments().make(kNoon)->descriptor);
      segments().position_line("# a: b\n");
      segments().unmake();
    } else if (command == "written") {  // FILE at SECOND
      const auto file = next<std::string>(words);
      const timespec at{second_of(next<std::string>(words)), 0}, both[2] = {at, at};
      ::utimensat(AT_FDCWD, path(file).c_str(), both, 0);
    } else if (command == "begins") {
      const std::int64_t second = second_of(next<std::string>(words));
      give(segments().begins_new(second, next<std::int64_t>(words)) ? "yes" : "no");
    } else if (command == "run") {  // calls retain() once a second
      for (std::int64_t left = next<std::int64_t>(words); left > 0; --left, ++uptime_s_) segments().retain();
    } else if (command == "uptime") {
      uptime_s_ = next<std::int64_t>(words);
    } else if (command == "make_room") {
      give(segments().make_room() ? "yes" : "no");
    } else if (command == "retention") {
      const auto status = segments().retention();
      give("{} segments of {} bytes, deleted {} of {} rows", status->segments, status->bytes, status->deleted_segments,
           status->deleted_rows);
      if (const auto& due = status->next)
        give("next {}: {} rows, {} bytes, by {} in {} s", due->file, due->rows, due->bytes,
             due->why == NextDeletion::Why::kAge ? "age" : "bytes", due->in_s);
    } else if (command == "stored") {
      EXPECT_TRUE(segments().begin());
      for (std::size_t i = 0; i < segments().stored().size(); ++i)
        give("{} from row {}: {}", segments().stored()[i].number, segments().first(i), segments().stored()[i].file);
      give("id {:.3}, end {}", segments().id(), segments().end());
    } else if (command == "text") {
      std::istringstream in(test::content(path(next<std::string>(words))));
      for (std::string line; std::getline(in, line);) give(line);
    } else if (command == "exists") {
      give(fs::exists(path(next<std::string>(words))) ? "yes" : "no");
    } else if (command == "lock") {
      other_ = ::open(path(next<std::string>(words)).c_str(), O_RDONLY | O_CLOEXEC);
      EXPECT_EQ(::flock(other_, LOCK_EX), 0);
    } else if (command == "unlock") {
      ::close(other_);
    } else {
      return false;
    }
    return true;
  }

  std::string extension_ = ".csv";
  std::optional<SegmentPolicy> policy_;
  std::optional<Segments> segments_;
  int other_ = -1;
};

TEST(Segments, Scripts) { test::expect_scripts<SegmentsPlayer>("log/segments.txt"); }

TEST(Segments, CostTheSameHoweverManyThereAre) {
  const test::TemporaryFolder folder;
  Segments segments(test::segments_in(folder.file("log")), "gyro", ".csv");
  long before = 0;
  for (int i = 0; i < 100; ++i) {
    ::close(segments.make(kNoon + i)->descriptor);
    if (i == 0) before = test::entries_read;
  }
  EXPECT_EQ(test::entries_read, before) << "no folder is read for a new segment";
  EXPECT_EQ(segments.stored().size(), 100u);
}

}  // namespace
}  // namespace prism::log
