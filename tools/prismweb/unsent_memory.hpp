// SPDX-License-Identifier: MIT
// Limits the memory of the data that clients have not received yet.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <set>

namespace prism::prismweb {

/// Counts the unsent data of all connections. Above the limit, the connection with the most is closed, as in prismd.
/// Not thread-safe.
class UnsentMemory {
 public:
  static constexpr std::size_t kMaxBytes = 128 << 20;

  /// The unsent data of one connection; removed from the sum by the destructor.
  class Part {
   public:
    /// `close` closes the connection and frees what it can. It may be called during add() of any part, at most once.
    Part(std::shared_ptr<UnsentMemory> all, std::function<void()> close);
    ~Part();
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;

    /// Both have no effect after `close` was called.
    void add(std::size_t bytes);
    void remove(std::size_t bytes);

   private:
    friend class UnsentMemory;
    const std::shared_ptr<UnsentMemory> all_;
    const std::function<void()> close_;
    std::size_t bytes_ = 0;
    bool is_closed_ = false;
  };

  std::size_t bytes() const { return bytes_; }

  /// Returns freed memory to the system if much data was sent or discarded since the last call. Call every few seconds.
  void trim();

 private:
  void close_largest();

  std::set<Part*> parts_;
  std::size_t bytes_ = 0, peak_bytes_ = 0;  ///< peak_bytes_: since the last trim
};

}  // namespace prism::prismweb
