// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/source.hpp"

namespace prism::recordings {

Result<Recording> read_source(const std::string& path, const SourceOptions& options) {
  if (!options.map.empty()) return read_mapped(path, options);
  return is_capture(path) ? read_capture(path, options) : read_recording(path);
}

}  // namespace prism::recordings
