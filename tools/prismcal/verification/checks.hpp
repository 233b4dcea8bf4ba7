// SPDX-License-Identifier: MIT
// The checks of each file type, one source file each.
#pragma once

#include <optional>
#include <string>

#include "base/result.hpp"
#include "tools/prismcal/tables/read_meter.hpp"
#include "tools/prismcal/verification/folder_contents.hpp"
#include "tools/prismcal/verification/verify.hpp"

namespace prism::verification {

/// Text of `error` without `path`: "what", or "LINE: what" if it has a line.
std::string without_path(const Error& error, const std::string& path);

/// Checks segments, rows, sessions and index of contents.log.
void check_log(const FolderContents& contents, const tables::ReadProgress& progress, VerificationResult& result);
/// Checks the captures of a folder and their index.
void check_captures(const FolderContents& contents, VerificationResult& result);
struct CheckedCapture {
  Finding finding;
  std::string damage;  ///< readable text on bytes that are not packets; empty if undamaged
};
CheckedCapture check_capture(const std::string& path);
/// Reads a table of another program to its end.
Finding check_table(const std::string& path);
/// Checks a model, a frame description or a configuration. Returns nullopt for JSON of another type, unless it is
/// `named` on the command line: then it is checked as a configuration.
std::optional<Finding> check_document(const std::string& path, bool named);

}  // namespace prism::verification
