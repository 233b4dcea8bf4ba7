// SPDX-License-Identifier: MIT
// A unix socket that a program listens on: made in the place of a leftover, removed only if it is still this program's
// own.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>

#include "base/file.hpp"
#include "base/result.hpp"

namespace prism {

/// Removes the socket's file at its end, but no file that somebody else has put there since.
class OwnSocketFile {
 public:
  OwnSocketFile() = default;
  /// The socket that stands at `path` now is this program's.
  explicit OwnSocketFile(std::string path) : path_(std::move(path)), own_(FileId::of(path_)) {}
  OwnSocketFile(OwnSocketFile&& other) noexcept
      : path_(std::move(other.path_)), own_(std::exchange(other.own_, std::nullopt)) {}
  OwnSocketFile& operator=(OwnSocketFile&&) = delete;
  ~OwnSocketFile();

 private:
  std::string path_;
  std::optional<FileId> own_;
};

/// Listens on a socket of this mode. A socket file that nobody answers on is a leftover and is replaced. Refused: the
/// path is too long, is no socket, or another process listens there; the socket cannot be made.
Result<Descriptor> listen_unix(const std::string& path, mode_t mode);

}  // namespace prism
