// SPDX-License-Identifier: MIT
// Time series of one instance: one archive per axis, and the method `range`.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "tools/prismweb/axis_archive.hpp"
#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

class Archive {
 public:
  /// `folder`: directory of all stores; empty: no stores. `disk`: thread that reads and writes them.
  Archive(boost::asio::io_context& io, InstanceProxy& proxy, DiskThread& disk, std::string folder);

  void connected();
  void notified(const Notification& notification);
  void finish();

  /// See docs/protocol.md, "range". Calls `answer` now or later.
  void range(const nlohmann::json& params, const InstanceProxy::Answer& answer);
  /// Returns the last seconds as objects, with the names and units of the log.
  void rows(const nlohmann::json& params, const InstanceProxy::Answer& answer);

 private:
  std::unique_ptr<AsyncStore> store_of(const std::string& axis) const;
  AxisArchive* axis_of(const nlohmann::json& params);
  std::string wrong_axis() const;

  boost::asio::io_context& io_;
  InstanceProxy& proxy_;
  DiskThread& disk_;
  std::string folder_;
  std::map<std::string, std::shared_ptr<AxisArchive>> axes_;
};

/// Makes a path component from a name: all characters except letters, digits, '_', '-' and '.' become %XX, as does a
/// leading '.'.
std::string path_part(const std::string& name);

}  // namespace prism::prismweb
