// SPDX-License-Identifier: MIT
// Files that are not text: MATLAB's .mat, and those that prism refuses with the way to export them.
#pragma once

#include <memory>
#include <string>

#include "base/result.hpp"
#include "tools/prismcal/tables/table_source.hpp"

namespace prism::tables {

struct Container {
  bool is_mat = false;
  std::string refusal;  ///< not empty: a file that prism does not read, and how to export it
};

/// By the first bytes. Errors: those of FileReader::open().
Result<Container> container_of(const std::string& path);

/// The vectors, matrices, structs and timeseries of a .mat file (version 5 to 7.3) as one table; see
/// docs/your-files.md.
Result<std::unique_ptr<TableSource>> open_mat(const std::string& path, const TableOptions& options);

}  // namespace prism::tables
