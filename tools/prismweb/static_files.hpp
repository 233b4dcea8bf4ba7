// SPDX-License-Identifier: MIT
// The files of the page and of its chart library.
#pragma once

#include <string>
#include <string_view>

namespace prism::prismweb {

struct StaticFile {
  int status = 404;  ///< 200, or 404 where there is none to serve
  std::string media_type, etag, body;
};

/// Of a target like "/lib/charts.js" the path below the folder, "lib/charts.js"; "/" is "index.html". Empty where the
/// target is none that is served: a name that begins with a dot or has characters other than letters, digits, '_', '-',
/// '.'; deeper than `folders`; an ending without a media type.
std::string file_of_target(std::string_view target, int folders = 1);

/// By the ending; empty where files of it are not served.
std::string_view media_type(std::string_view path);

/// Reads `target` below `folder`. A file above 16 MiB is none.
StaticFile read_static(const std::string& folder, std::string_view target, int folders = 1);

}  // namespace prism::prismweb
