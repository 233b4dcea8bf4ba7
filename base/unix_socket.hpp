// SPDX-License-Identifier: MIT
// A listening Unix socket: replaces a leftover file, and removes its file only if it is still its own.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>

#include "base/file.hpp"
#include "base/result.hpp"

namespace prism {

/// Removes the socket file in the destructor, unless another process has replaced it.
class OwnSocketFile {
 public:
  OwnSocketFile() = default;
  /// The socket at `path` now belongs to this program.
  explicit OwnSocketFile(std::string path) : path_(std::move(path)), own_(FileId::of(path_)) {}
  OwnSocketFile(OwnSocketFile&& other) noexcept
      : path_(std::move(other.path_)), own_(std::exchange(other.own_, std::nullopt)) {}
  OwnSocketFile& operator=(OwnSocketFile&&) = delete;
  ~OwnSocketFile();
  /// False if another file, or none, is at the path: clients cannot reach this process any more.
  bool is_in_place() const { return !own_ || FileId::of(path_) == own_; }

 private:
  std::string path_;
  std::optional<FileId> own_;
};

/// Listens on a socket of this mode. Replaces a socket file without a listener. Errors: the path is too long or not a
/// socket, another process listens on it, or the socket cannot be created.
Result<Descriptor> listen_unix(const std::string& path, mode_t mode);

}  // namespace prism
