// SPDX-License-Identifier: MIT
// Sends notifications to all clients; each text is written once for all of them.
#pragma once

#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/pipeline/pipeline.hpp"
#include "daemon/socket/client.hpp"
#include "daemon/socket/event_log.hpp"
#include "daemon/socket/history.hpp"
#include "daemon/socket/row_text.hpp"

namespace prism::socket {

/// Samples of one call are sent together: one send for many rows at high rates, no delay at low rates. Windows and
/// events are sent at once after the samples before them, those of several axes in one send. Windows are held until
/// they are in the log, so that every published window survives a kill; events about rows (quality, implausible) wait
/// with them. If the disk does not respond for more than a second, windows are sent without waiting.
class Publisher {
 public:
  void add(std::shared_ptr<Client> client);
  void remove(const Client* client);
  /// Call after a client's subscription changed.
  void update();

  /// `unwritten`: rows of the log are not written yet; holds the windows until rows_written().
  void rows(const pipeline::Rows& rows, bool unwritten = false);
  /// All rows passed to the log are written, or were dropped and counted.
  void rows_written();
  /// Call once a second. Sends the held windows if some were held at the last call, too.
  void release_late();
  /// Sends the held windows and events.
  void release();
  void event(const Event& event);

  std::size_t clients() const { return clients_.size(); }
  const std::vector<std::shared_ptr<Client>>& all() const { return clients_; }
  std::uint64_t lost_rows() const;
  /// `axis`: index in the pipeline.
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
