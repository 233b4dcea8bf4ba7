// SPDX-License-Identifier: MIT
// Tells all clients: each report is serialised once, whoever many listen.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/client.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/row_text.hpp"

namespace prism::daemon {

/// The samples of one call go out together: one send for many rows at high rates, and no delay at low ones. Windows and
/// events go out at once, after the samples before them, those of several axes in one send; windows that are not in the
/// log yet may be held until they are: a process that is killed has then lost no window that somebody was told.
class Publisher {
 public:
  void add(std::shared_ptr<Client> client);
  void remove(const Client* client);
  /// Takes note of the client's changed subscription.
  void update();

  /// `hold`: the windows wait for release(), or for windows that need not wait.
  void rows(const pipeline::Rows& rows, bool hold = false);
  void release();
  bool holds() const { return !held_.empty(); }
  /// `params`: the JSON object of an event notification.
  void event(const std::string& params);

  std::size_t clients() const { return clients_.size(); }
  const std::vector<std::shared_ptr<Client>>& all() const { return clients_; }
  std::uint64_t lost_rows() const;

 private:
  // Clients that want every n-th sample of the same axes share one text.
  struct Topic {
    std::uint32_t every, axes;
    std::vector<std::uint32_t> due;  // by axis
    std::uint64_t rows = 0;
    RowText text;
  };
  struct Window {
    std::uint32_t axis;
    std::string text;
  };

  void sample(const pipeline::Rows::Sample& sample);
  void window(const pipeline::Rows::Window& window);
  void send_windows(std::uint32_t axes);
  void know(const pipeline::Rows& rows);
  void flush();

  std::vector<std::shared_ptr<Client>> clients_;
  std::vector<Topic> topics_;
  std::vector<Window> held_;
  std::shared_ptr<const std::vector<std::string>> axes_;
  std::vector<std::string> heads_;  // of a sample, by axis
  std::uint64_t lost_by_gone_ = 0;
};

}  // namespace prism::daemon
