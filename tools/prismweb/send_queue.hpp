// SPDX-License-Identifier: MIT
// Bounded output queue of one client; counts dropped rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "tools/prismweb/subscription_table.hpp"
#include "tools/prismweb/unsent_memory.hpp"

namespace prism::prismweb {

class SendQueue {
 public:
  static constexpr std::size_t kMaxBatchBytes = 2 << 20, kMaxBytes = 16 << 20, kPauseBytes = 1 << 20;
  /// Counted for each text in addition to its size: the string, its shared pointer and the queue's entry.
  static constexpr std::size_t kTextBytes = 128;

  /// Returns the message that `rows` rows of an instance were dropped now, `rows_total` in total.
  using LostText =
      std::function<std::string(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total)>;
  /// `close` closes the connection; it is called if the unsent data of all clients exceeds the limit.
  SendQueue(std::shared_ptr<UnsentMemory> memory, std::function<void()> close, LostText lost_text);
  SendQueue(const SendQueue&) = delete;
  SendQueue& operator=(const SendQueue&) = delete;

  /// Queues a response. Returns false if the queue is too long: disconnect the client.
  bool answer(const Text& text);
  /// Queues a batch. If it does not fit, drops and counts it and all others until the queue is empty: one gap instead
  /// of many.
  void batch(const std::string& instance, const Text& text, std::uint64_t rows);

  /// True while the client should send no further requests: its responses are unread.
  bool is_paused() const { return answer_bytes_ > kPauseBytes; }
  bool empty() const { return waiting_.empty(); }
  /// Size of the queued texts and of the one being sent.
  std::size_t bytes() const { return bytes_; }
  /// Removes and returns the next text, which is counted until sent().
  Text take();
  /// The text of take() was sent. After the last one, queues a "lost" for each instance with dropped rows.
  void sent();

 private:
  struct Lost {
    std::uint64_t rows = 0, rows_total = 0;
  };
  struct Waiting {
    Text text;
    bool is_answer;
  };
  void put(const Text& text, bool is_answer);
  void queue_lost();
  void discard();

  UnsentMemory::Part memory_;
  std::function<void()> close_;
  LostText lost_text_;
  std::deque<Waiting> waiting_;
  std::size_t bytes_ = 0, answer_bytes_ = 0, sending_bytes_ = 0, sending_answer_bytes_ = 0;
  std::map<std::string, Lost> lost_;
  bool losing_ = false, is_closed_ = false;
};

}  // namespace prism::prismweb
