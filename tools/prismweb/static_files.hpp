// SPDX-License-Identifier: MIT
// Serves the files of the page and of its chart library.
#pragma once

#include <string>
#include <string_view>

namespace prism::prismweb {

struct StaticFile {
  int status = 404;  ///< 200 or 404
  std::string media_type, etag, body;
};

/// Returns the relative path of a target: "/lib/charts.js" → "lib/charts.js", "/" → "index.html". Returns an empty
/// string if the target is not served:
/// - a name begins with a dot, or has characters other than letters, digits, '_', '-' and '.'
/// - more than `folders` directories
/// - an extension without a media type
std::string file_of_target(std::string_view target, int folders = 1);

/// Media type of the extension; empty if such files are not served.
std::string_view media_type(std::string_view path);

/// Reads `target` below `folder`. Files above 16 MiB are not served.
StaticFile read_static(const std::string& folder, std::string_view target, int folders = 1);

}  // namespace prism::prismweb
