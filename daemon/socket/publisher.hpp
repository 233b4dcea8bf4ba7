// SPDX-License-Identifier: MIT
// Sends notifications to subscribed clients; one text per distinct subscription.
#pragma once

#include <algorithm>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "compensation/compensated.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/socket/client.hpp"
#include "daemon/socket/event_log.hpp"

namespace prism::socket {

// The rows of the last hour as JSON, written once for notifications and for `history`.

/// Rows are stored in blocks that send queues share: a response of an hour copies only the last block.
class History {
 public:
  static constexpr std::size_t kRows = 3600;

  /// `axis`: name of the axis. Returns the row's JSON, valid until the next call.
  std::string_view add(const compensation::CompensatedWindow& row, std::string_view axis);
  std::size_t size() const;
  bool empty() const { return blocks_.empty(); }

  /// Returns the last `count` rows, or all if there are fewer, as a JSON array in consecutive parts, oldest first.
  std::vector<TextPart> json(std::size_t count) const;

 private:
  std::size_t kept() const;

  static constexpr std::size_t kBlockRows = 60;
  struct Block {
    std::string text;                 ///< each row followed by a comma
    std::vector<std::size_t> begins;  ///< where each row begins
  };
  std::deque<std::shared_ptr<Block>> blocks_;  ///< only the last one grows
};

// Buffer for the JSON of many rows, and functions that write a row with its axis.

/// A growing buffer. Rows are written directly into it, without a copy.
class RowText {
 public:
  /// Returns the end of the text, with space for `most` more characters. Valid until the next call.
  char* room(std::size_t most) {
    if (capacity_ - size_ < most) grow(most);
    return text_.get() + size_;
  }
  /// Sets the end of the text, within the space that room() returned.
  void end_at(const char* end) { size_ = static_cast<std::size_t>(end - text_.get()); }
  void clear() { size_ = 0; }
  std::string_view view() const { return {text_.get(), size_}; }

 private:
  void grow(std::size_t most) {
    capacity_ = std::max(2 * capacity_, size_ + most);
    std::unique_ptr<char[]> larger(new char[capacity_]);
    if (size_ > 0) std::memcpy(larger.get(), text_.get(), size_);
    text_ = std::move(larger);
  }

  std::unique_ptr<char[]> text_;
  std::size_t size_ = 0, capacity_ = 0;
};

/// Start of a row's JSON for put_row(): {"axis":"x"
std::string row_head(std::string_view axis);

/// Writes a row as JSON, starting with its axis. `at` must have space for `head` and compensation::kJsonChars.
char* put_row(char* at, std::string_view head, const compensation::Compensated& row);
/// Appends a row as JSON, starting with its axis.
void append_row(std::string& text, std::string_view axis, const compensation::CompensatedWindow& row);

/// Samples of one call are sent together: one send for many rows at high rates, no delay at low rates. Windows and
/// events are sent at once after the samples before them, those of several axes in one send. While rows are not in the
/// log yet (`unwritten`), windows are held until rows_written(), so that every published window survives a kill of
/// prismd, but not a power cut. Events about rows (quality, implausible) wait with them; other events may overtake
/// them. If the disk does not respond for 1 to 2 s, windows are sent without waiting.
///
/// Use only on the thread of the clients' io_context.
class Publisher {
 public:
  void add(std::shared_ptr<Client> client);
  void remove(const Client* client);
  /// Call after a client's subscription changed.
  void update();

  /// Axis indices must be below 32. If `unwritten` (rows of the log are not written yet), windows are held until
  /// rows_written(); else sent at once.
  void rows(const pipeline::Rows& rows, bool unwritten = false);
  /// All rows passed to the log are written, or were dropped and counted.
  void rows_written();
  /// Call once a second. If windows are held at two successive calls, sends them, and holds none until rows_written().
  void release_late();
  /// Sends the held windows and events.
  void release();
  void event(const Event& event);

  std::size_t clients() const { return clients_.size(); }
  const std::vector<std::shared_ptr<Client>>& all() const { return clients_; }
  std::uint64_t lost_rows() const;
  /// `axis`: index in the pipeline. Empty before the first row, and for an axis that does not exist.
  const History& history(std::size_t axis) const;

 private:
  // Clients that subscribed to every n-th sample of the same axes share one text.
  struct Topic {
    std::uint32_t every, axes;
    std::vector<std::uint32_t> due;  // by axis
    std::uint64_t rows = 0;
    RowText text;
  };
  struct Held {
    std::uint32_t axis;  // or kEvent
    std::string text;
  };
  static constexpr std::uint32_t kEvent = ~std::uint32_t{0};
  struct Choice {
    std::uint32_t axes;
    bool windows, events;
    auto operator<=>(const Choice&) const = default;
    bool wants(std::uint32_t axis) const { return axis == kEvent ? events : windows && (axes >> axis & 1) != 0; }
  };
  static Choice choice_of(const Client& client);

  void sample(const pipeline::Rows::Sample& sample);
  void window(const pipeline::Rows::Window& window);
  void send_held(const Choice& choice);
  void use_axes(const pipeline::Rows& rows);
  void flush();

  std::vector<std::shared_ptr<Client>> clients_;
  std::vector<Topic> topics_;
  std::vector<Held> held_;
  bool held_before_ = false, disk_late_ = false;  // at the last release_late()
  std::vector<History> histories_;                // by axis
  std::shared_ptr<const std::vector<std::string>> axes_;
  std::vector<std::string> heads_;  // of a sample, by axis
  std::uint64_t lost_by_gone_ = 0;
};

}  // namespace prism::socket
