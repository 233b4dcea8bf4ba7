// SPDX-License-Identifier: MIT
// Tells all clients: each report is written as text once, however many listen.
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

/// The samples of one call go out together: one send for many rows at high rates, and no delay at low ones. Windows and
/// events go out at once, after the samples before them, those of several axes in one send. Windows that are not in the
/// log yet are held until they are: a process that is killed has then lost no window that somebody was told. Events
/// about rows (quality, implausible) wait behind them. A disk that takes nothing for a second and more is not waited
/// for.
class Publisher {
 public:
  void add(std::shared_ptr<Client> client);
  void remove(const Client* client);
  /// Takes note of the client's changed subscription.
  void update();

  /// `unwritten`: rows of the log wait for the disk, and the windows for rows_written().
  void rows(const pipeline::Rows& rows, bool unwritten = false);
  /// The disk has every row that it was given, or counted it as lost.
  void rows_written();
  /// Once a second and not more often: what was held at the last call, too, goes out.
  void release_late();
  /// What is held goes out.
  void release();
  void event(const Event& event);

  std::size_t clients() const { return clients_.size(); }
  const std::vector<std::shared_ptr<Client>>& all() const { return clients_; }
  std::uint64_t lost_rows() const;
  /// Of an axis of the pipeline.
  const History& history(std::size_t axis) const;

 private:
  // Clients that want every n-th sample of the same axes share one text.
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
  void know(const pipeline::Rows& rows);
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
