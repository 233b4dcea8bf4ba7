// SPDX-License-Identifier: MIT
// Sends notifications to subscribed clients; one text per distinct subscription.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.hpp"
#include "daemon/socket/client.hpp"
#include "daemon/socket/event_log.hpp"

namespace prism::socket {

/// The rows of the last hour as JSON, written once for notifications and for `history`. Responses share their text, so
/// that many clients that do not read cost little memory.
class History {
 public:
  static constexpr std::size_t kRows = 3600;

  void add(const std::string& row);
  std::size_t size() const { return std::min(kRows, stored()); }
  /// Appends the last `count` rows, or all if there are fewer, with commas between them, oldest first.
  void append_to(std::vector<Piece>& pieces, std::size_t count) const;

 private:
  static constexpr std::size_t kBlockRows = 100;
  /// Rows, each after a comma. The last block still grows: responses copy it.
  struct Block {
    std::shared_ptr<std::string> text = std::make_shared<std::string>();
    std::vector<std::size_t> begins;  ///< of its rows, behind the comma
  };
  std::size_t stored() const {
    return blocks_.empty() ? 0 : (blocks_.size() - 1) * kBlockRows + blocks_.back().begins.size();
  }
  std::deque<Block> blocks_;
};

/// The rows of one call are sent together, in the pipeline's order: one send for many rows at high rates, no delay at
/// low rates. While rows are not in the log yet (`unwritten`), windows are held until rows_written(), so that every
/// published window survives a kill of prismd, but not a power cut. Events about rows (quality, implausible) wait with
/// them; samples and other events may overtake them. If the disk does not respond for 1 to 2 s, windows are sent
/// without waiting.
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
  /// Clients with the same subscription share one text.
  struct Feed {
    Subscription wanted;
    std::vector<std::uint32_t> due;  ///< by axis: samples up to the next one that is sent
    std::string text = {};           ///< for the next flush()
    std::uint64_t lines = 0;
  };
  /// Of a window or event.
  struct Line {
    std::size_t axis;  ///< or kEvent
    std::string text;
  };
  static constexpr std::size_t kEvent = ~std::size_t{0};

  void sample(const pipeline::Rows::Sample& sample);
  void window(const pipeline::Rows::Window& window);
  void pass(const Line& line);
  void release_held();
  void use_axes(const pipeline::Rows& rows);
  void flush();

  std::vector<std::shared_ptr<Client>> clients_;
  std::vector<Feed> feeds_;
  std::vector<Line> held_;
  bool held_before_ = false, disk_late_ = false;  // at the last release_late()
  std::vector<History> histories_;                // by axis
  std::shared_ptr<const std::vector<std::string>> axes_;
  std::vector<std::string> heads_;  // of a sample, by axis
  std::uint64_t lost_by_gone_ = 0;
};

}  // namespace prism::socket
