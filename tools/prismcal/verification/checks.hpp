// SPDX-License-Identifier: MIT
// The checks of each file type, one source file each.
#pragma once

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
}  // namespace prism::verification
