// SPDX-License-Identifier: MIT
// The checks of each file type, one source file each.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "tools/prismcal/verification/folder_contents.hpp"
#include "tools/prismcal/verification/verify.hpp"

namespace prism::verification {

/// "what", or "LINE: what" where the refusal names a place in the file.
std::string without_path(const Error& error, const std::string& path);

/// Segments, rows, sessions and index of contents.log.
void check_log(const FolderContents& contents, VerificationResult& result);
/// Captures of a folder, and their index.
void check_captures(const FolderContents& contents, VerificationResult& result);
struct CheckedCapture {
  Finding finding;
  std::string damage;  ///< the parts that are not packets; empty if there are none
};
CheckedCapture check_capture(const std::string& path);
/// A model, a frame description or a configuration. Nothing: JSON of another kind; `named` by a person: a
/// configuration.
std::optional<Finding> check_document(const std::string& path, bool named);

}  // namespace prism::verification
