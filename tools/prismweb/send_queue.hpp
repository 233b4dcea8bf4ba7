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

namespace prism::prismweb {

/// Memory of the queued responses of all clients. Not thread-safe.
struct AnswerMemory {
  std::size_t bytes = 0;
};

class SendQueue {
 public:
  static constexpr std::size_t kMaxBatchBytes = 2 << 20, kMaxBytes = 16 << 20;
  /// Limit of the responses of all clients; above it, each client may still queue kGuaranteedBytes.
  static constexpr std::size_t kMaxAllBytes = 128 << 20, kGuaranteedBytes = 2 << 20;

  /// Returns the message that `rows` rows of an instance were dropped now, `rows_total` in total.
  using LostText =
      std::function<std::string(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total)>;
  SendQueue(std::shared_ptr<AnswerMemory> memory, LostText lost_text)
      : memory_(std::move(memory)), lost_text_(std::move(lost_text)) {}
  ~SendQueue() { memory_->bytes -= answer_bytes_; }
  SendQueue(const SendQueue&) = delete;
  SendQueue& operator=(const SendQueue&) = delete;

  /// Queues a response. Returns false if the queue is too long: disconnect the client.
  bool answer(const Text& text);
  /// Queues a batch. If it does not fit, drops and counts it and all others until the queue is empty: one gap instead
  /// of many.
  void batch(const std::string& instance, const Text& text, std::uint64_t rows);

  bool empty() const { return waiting_.empty(); }
  std::size_t bytes() const { return bytes_; }
  /// Removes and returns the next text. After the last one, queues a "lost" for each instance with dropped rows.
  Text take();

 private:
  struct Lost {
    std::uint64_t rows = 0, rows_total = 0;
  };
  struct Waiting {
    Text text;
    std::size_t answer_bytes;  ///< 0: a batch, shared with other clients
  };
  void put(const Text& text, bool is_answer);
  void queue_lost();

  const std::shared_ptr<AnswerMemory> memory_;
  LostText lost_text_;
  std::deque<Waiting> waiting_;
  std::size_t bytes_ = 0, answer_bytes_ = 0;
  std::map<std::string, Lost> lost_;
  bool losing_ = false;
};

}  // namespace prism::prismweb
