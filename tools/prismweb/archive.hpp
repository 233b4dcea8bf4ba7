// SPDX-License-Identifier: MIT
// The series of one instance: an archive for each axis, and the method `range` over them.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "tools/prismweb/axis_archive.hpp"
#include "tools/prismweb/instance_proxy.hpp"

namespace prism::prismweb {

class Archive {
 public:
  /// `folder` of all stores; empty: none is kept. `disk` is where they are read and written.
  Archive(boost::asio::io_context& io, InstanceProxy& proxy, DiskThread& disk, std::string folder);

  void connected();
  void notified(const Notification& notification);
  void finish();

  /// docs/page.md, "range". The answer may come later.
  void range(const nlohmann::json& params, const InstanceProxy::Answer& answer);
  /// The last seconds as objects, with the names and units of the log.
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

/// A name as one part of a path: other characters than letters, digits, '_', '-' and '.' as %XX; so is a '.' at the
/// beginning.
std::string path_part(const std::string& name);

}  // namespace prism::prismweb
