// SPDX-License-Identifier: MIT
// What waits to be sent to one client: bounded, and what did not fit is counted.
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

/// What the answers to all clients hold together; of one thread.
struct AnswerMemory {
  std::size_t bytes = 0;
};

class SendQueue {
 public:
  static constexpr std::size_t kMostBatchBytes = 2 << 20, kMostBytes = 16 << 20;
  /// Of the answers of all clients together; where there are more, each may have its part of it.
  static constexpr std::size_t kMostOfAll = 128 << 20, kPart = 2 << 20;

  /// What tells a client that so many rows of an instance were left out, now and in all.
  using LostText =
      std::function<std::string(const std::string& instance, std::uint64_t rows, std::uint64_t rows_total)>;
  SendQueue(std::shared_ptr<AnswerMemory> memory, LostText lost_text)
      : memory_(std::move(memory)), lost_text_(std::move(lost_text)) {}
  ~SendQueue() { memory_->bytes -= answer_bytes_; }
  SendQueue(const SendQueue&) = delete;
  SendQueue& operator=(const SendQueue&) = delete;

  /// False: so much lies here that the client should be given up.
  bool answer(const Text& text);
  /// Left out and counted where it does not fit, and so are all until the queue is empty: one hole, not a sieve.
  void batch(const std::string& instance, const Text& text, std::uint64_t rows);

  bool empty() const { return waiting_.empty(); }
  std::size_t bytes() const { return bytes_; }
  /// The next text. Behind the last one come the "lost" of each instance.
  Text take();

 private:
  struct Lost {
    std::uint64_t rows = 0, rows_total = 0;
  };
  struct Waiting {
    Text text;
    std::size_t answer_bytes;  ///< 0: a batch, which its listeners share
  };
  void put(const Text& text, bool is_answer);
  void tell_lost();

  const std::shared_ptr<AnswerMemory> memory_;
  LostText lost_text_;
  std::deque<Waiting> waiting_;
  std::size_t bytes_ = 0, answer_bytes_ = 0;
  std::map<std::string, Lost> lost_;
  bool losing_ = false;
};

}  // namespace prism::prismweb
