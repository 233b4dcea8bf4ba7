// SPDX-License-Identifier: MIT
// Texts for clients, as scripts: subscriptions, queues and losses (publisher.txt), events and their repeats
// (events.txt).
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cctype>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "daemon/socket/event_log.hpp"
#include "daemon/socket/publisher.hpp"
#include "tests/support/daemon_parts.hpp"
#include "tests/support/scripts.hpp"

namespace prism::socket {
namespace {

using test::next;
using Lines = std::vector<std::string>;

/// A publisher and its clients. "rows x1 Y x2": samples of axis x at seconds 1 and 2, and between them a window of y.
class PublisherPlayer {
 public:
  ~PublisherPlayer() {
    for (const auto& [name, peer] : peers_) publisher_.remove(peer->client().get());
  }

  Lines play(const std::string& command, std::istream& words) {
    if (command == "axes") {
      axes_ = test::rest_of(words);
    } else if (command == "client") {  // NAME [EVERY] [windows] [events] [axes LIST]
      const auto name = next<std::string>(words);
      if (!peers_.contains(name)) publisher_.add((peers_[name] = std::make_unique<test::Asker>(10'000))->client());
      Subscription wanted;
      for (std::string word; words >> word;) {
        if (std::isdigit(word[0])) wanted.sample_every = static_cast<std::uint32_t>(std::stoul(word));
        if (word == "windows") wanted.windows = true;
        if (word == "events") wanted.events = true;
        if (word != "axes") continue;
        wanted.axes = 0;
        for (const char axis : next<std::string>(words)) wanted.axes |= 1U << axes_.find(axis);
      }
      peers_[name]->client()->subscription = wanted;
      publisher_.update();
    } else if (command == "rows") {
      rows(words);
    } else if (command == "event") {
      Event event;
      event.kind = next<std::string>(words);
      event.json = "{}";
      publisher_.event(event);
    } else if (command == "written") {
      publisher_.rows_written();
    } else if (command == "release") {
      publisher_.release();
    } else if (command == "tick") {
      publisher_.release_late();
    } else if (command == "remove") {
      publisher_.remove(peer(words).client().get());
    } else if (command == "received") {
      return {received(peer(words))};
    } else if (command == "lost") {
      return {fmt::format("{} of {} clients", publisher_.lost_rows() > 0 ? "some" : "none", publisher_.clients())};
    } else if (command == "overflow") {  // rows until one is lost; the others read
      test::Asker& deaf = peer(words);
      for (std::int64_t second = 1; deaf.client()->lost_rows() == 0 && second < 100'000; ++second) {
        std::istringstream one("z" + std::to_string(second));
        rows(one);
        for (const auto& [name, other] : peers_)
          if (other.get() != &deaf) other->read();
      }
    } else {
      return of_client(command, words);
    }
    return {};
  }

 private:
  /// A client alone: "send NAME N": a row of 100 characters with its number.
  Lines of_client(const std::string& command, std::istream& words) {
    test::Asker& asker = peer(words);
    Client& client = *asker.client();
    if (command == "send") {
      send_row(client, next<int>(words));
    } else if (command == "fill") {  // the kernel's buffer and the queue, until a row is lost
      for (sent_ = 0; client.lost_rows() == 0 && sent_ < 100'000;) send_row(client, sent_++);
    } else if (command == "answer") {
      client.answer(test::rest_of(words) + "\n");
    } else if (command == "answers") {  // without reading
      std::size_t queued = 0;
      for (int i = 0; client.open() && i < 10'000; ++i) {
        queued = client.queued_bytes();
        client.answer(std::string(9999, 'a') + "\n");
      }
      return {fmt::format("{} with {} bytes queued", client.open() ? "open" : "closed", queued)};
    } else if (command == "pieces") {  // NAME SIZE FROM …: of one response
      std::vector<Piece> pieces;
      for (std::size_t size; words >> size;)
        pieces.push_back({std::make_shared<const std::string>(size, 'a'), next<std::size_t>(words)});
      client.answer(std::move(pieces));
    } else if (command == "queued") {
      return {std::to_string(client.queued_bytes())};
    } else if (command == "shut_down") {  // only sending
      asker.shut_down();
    } else if (command == "take") {  // what was sent without the peer's reading
      return {fmt::format("{} bytes", asker.take().size())};
    } else if (command == "hang_up") {
      asker.hang_up();
    } else if (command == "poll") {
      asker.poll();
    } else if (command == "close") {
      client.close();
    } else if (command == "read") {
      return read(asker);
    } else if (command == "state") {
      return {fmt::format("{}{}{}, {} rows lost", client.open() ? "open" : "closed", client.gone() ? ", gone" : "",
                          client.privileged() ? ", privileged" : "", client.lost_rows())};
    } else {
      return {"unknown command"};
    }
    return {};
  }

  static void send_row(Client& client, int number) {
    std::string text = "row " + std::to_string(number) + " ";
    text.resize(99, '.');
    client.send(std::make_shared<const std::string>(text + "\n"), 1);
  }

  /// The rows in order as "rows 0 to 7", other lines as they are.
  Lines read(test::Asker& asker) const {
    std::istringstream in(asker.read());
    Lines lines;
    int rows = 0;
    for (std::string line; std::getline(in, line);) {
      const bool is_row = line.size() == 99 && line.starts_with("row " + std::to_string(rows) + " ");
      if (is_row) ++rows;
      if (!is_row) lines.push_back(line.substr(0, line.find("..")));
    }
    if (rows > 0)
      lines.insert(lines.begin(), rows == sent_ - 1 ? "all rows but the last" : fmt::format("{} rows", rows));
    return lines;
  }

  test::Asker& peer(std::istream& words) { return *peers_.at(next<std::string>(words)); }

  void rows(std::istream& words) {
    pipeline::Rows rows;
    std::vector<std::string> names;
    for (const char axis : axes_) names.emplace_back(1, axis);
    rows.axes = std::make_shared<const std::vector<std::string>>(names);
    bool unwritten = false;
    for (std::string word; words >> word;) {
      if (word == "unwritten") {
        unwritten = true;
      } else if (const std::size_t axis = axes_.find(static_cast<char>(std::tolower(word[0]))); word.size() == 1) {
        rows.windows.push_back({axis, rows.samples.size(), 0, {}});
      } else {
        compensation::Compensated row;
        row.sample.time_ns = std::stoll(word.substr(1)) * 1'000'000'000;
        row.sample.rate_deg_per_h = 1.5;
        rows.samples.push_back({axis, row});
      }
    }
    publisher_.rows(rows, unwritten);
  }

  /// In the words of "rows", events as "!".
  static std::string received(test::Asker& peer) {
    std::istringstream in(peer.read());
    std::string all;
    for (std::string line; std::getline(in, line);) {
      const auto told = nlohmann::json::parse(line);
      if (!all.empty()) all += ' ';
      if (told["method"] == "event") {
        all += '!';
        continue;
      }
      const auto axis = told["params"]["axis"].get<std::string>();
      all += told["method"] == "window" ? std::string(1, static_cast<char>(std::toupper(axis[0])))
                                        : axis + std::to_string(told["params"]["time_s"].get<int>());
    }
    return all.empty() ? "nothing" : all;
  }

  std::string axes_ = "z";
  Publisher publisher_;
  std::map<std::string, std::unique_ptr<test::Asker>> peers_;
  int sent_ = 0;
};

TEST(Publisher, Scripts) { test::expect_scripts<PublisherPlayer>("socket/publisher.txt"); }

/// "N KIND TEXT": N events, one a second; prints those that are reported.
class EventPlayer {
 public:
  Lines play(const std::string& command, std::istream& words) {
    if (command == "pass") {
      now_ += std::chrono::seconds(next<int>(words));
      log_.tell_late(now_);
    } else if (command == "host_time") {
      time_ns_ = next<std::int64_t>(words);
    } else if (command == "severity") {  // 0 debug to 3 error
      severity_ = static_cast<Severity>(next<int>(words));
    } else if (command == "kept") {
      return {fmt::format("{}: {} to {}", log_.recent().size(), log_.recent().front().text, log_.recent().back().text)};
    } else if (command == "json") {
      return {log_.recent().back().json};
    } else {
      const auto kind = next<std::string>(words);
      const std::string text = test::rest_of(words);
      for (int i = 0; i < std::stoi(command); ++i, now_ += std::chrono::seconds(1))
        log_.add(severity_, kind, text == "#" ? std::to_string(i) : text, time_ns_++, now_);
    }
    Lines told = std::exchange(told_, {});
    return told.size() > 20 ? Lines{"many"} : told;
  }

 private:
  Lines told_;
  EventLog log_{[this](const Event& event) {
    told_.push_back(event.kind + ": " + event.text +
                    (event.repeats > 0 ? fmt::format(", {} repeats", event.repeats) : ""));
  }};
  Severity severity_ = Severity::kWarning;
  std::int64_t time_ns_ = 0;
  EventLog::Clock::time_point now_{std::chrono::seconds(1000)};
};

TEST(EventLog, Scripts) { test::expect_scripts<EventPlayer>("socket/events.txt"); }

TEST(EventLog, UsesTheClockThatRuns) {
  int told = 0;
  EventLog log([&](const Event&) { ++told; });
  for (int i = 0; i < 2; ++i) log.add(Severity::kInfo, "a", "\xff", 0);
  EXPECT_EQ(told, 1);
  EXPECT_EQ(log.recent().back().json, "{\"time_s\":0.0,\"severity\":\"info\",\"kind\":\"a\",\"text\":\"\xef\xbf\xbd\"}")
      << "UTF-8, whatever the text contains";
}

// The rows of the last hour in blocks, compared with a list of them.
TEST(History, HasTheLastRowsInOrder) {
  History history;
  std::vector<std::string> all;
  for (const std::size_t size :
       {0, 1, 2, 99, 100, 101, 199, 200, 250, 3599, 3600, 3601, 3699, 3700, 3701, 3750, 7300}) {
    for (; all.size() < size; all.push_back(std::to_string(all.size()))) history.add(std::to_string(all.size()));
    EXPECT_EQ(history.size(), std::min<std::size_t>(size, 3600));
    for (const std::size_t count : {1, 2, 50, 51, 99, 100, 101, 3599, 3600}) {
      std::vector<Piece> pieces;
      history.append_to(pieces, count);
      std::string text;
      for (const Piece& piece : pieces) text += piece.text->substr(piece.from);
      const std::size_t taken = std::min(count, history.size());
      EXPECT_EQ(text, fmt::to_string(fmt::join(all.end() - static_cast<std::ptrdiff_t>(taken), all.end(), ",")))
          << count << " of " << size;
      EXPECT_LE(pieces.size(), 37u);
    }
  }
}

// The sum of all queues may reach the limit, and not exceed it.
TEST(Client, TheLimitOfAllIsExact) {
  const auto memory = std::make_shared<ClientMemory>(1000);
  test::Asker full(1 << 20, memory), other(1 << 20, memory);
  const auto row = std::make_shared<const std::string>(std::string(99, 'r') + "\n");
  while (full.client()->lost_rows() == 0) full.client()->send(row, 1);
  EXPECT_EQ(full.client()->queued_bytes(), 1000u);
  EXPECT_TRUE(memory->has_room(0));
  EXPECT_FALSE(memory->has_room(1));
  other.client()->answer("\n");
  EXPECT_FALSE(full.client()->open());
  EXPECT_TRUE(other.client()->open());
  EXPECT_EQ(other.read(), "\n");
  EXPECT_TRUE(memory->has_room(1000));
  EXPECT_FALSE(memory->has_room(1001));
}

// Earlier bug: 250 clients with unread responses used 324 to 555 MB.
TEST(Client, AllTogetherHoldSoMuchAndTheOneThatHoldsMostGives) {
  const auto memory = std::make_shared<ClientMemory>(5'000'000);
  std::vector<std::unique_ptr<test::Asker>> peers;
  for (int i = 0; i < 8; ++i) peers.push_back(std::make_unique<test::Asker>(1 << 20, memory));
  const std::string answer = std::string(99'999, 'a') + "\n";
  for (int i = 0; i < 8; ++i) peers[1]->client()->answer(answer);
  EXPECT_TRUE(peers[1]->client()->open());
  for (int round = 0; round < 30; ++round) {
    for (const std::size_t i : {0u, 2u, 3u}) peers[i]->client()->answer(answer);
    EXPECT_TRUE(memory->has_room(0));
  }
  EXPECT_TRUE(peers[1]->client()->open()) << "what it holds is little";
  EXPECT_FALSE(peers[0]->client()->open() && peers[2]->client()->open() && peers[3]->client()->open());
  peers[4]->client()->answer("small\n");
  EXPECT_EQ(peers[4]->read(), "small\n") << "others are answered";
  peers.clear();
  EXPECT_TRUE(memory->has_room(5'000'000)) << "all is given back";
}

TEST(Client, IsIdleWhereItNeitherAsksNorListens) {
  test::Asker peer;
  EXPECT_LT(peer.client()->idle(), std::chrono::seconds(1));
  peer.client()->subscription.events = true;
  EXPECT_EQ(peer.client()->idle(), Client::Clock::duration::zero());
  EXPECT_EQ(peer.client()->user(), ::geteuid());
}

}  // namespace
}  // namespace prism::socket
