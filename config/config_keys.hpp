// SPDX-License-Identifier: MIT
// The keys of prismd.json: they are read, printed, and written to prismd.schema.json and prismd.json(5) by one table.
#pragma once

#include "base/json_table.hpp"
#include "config/config.hpp"

namespace prism::config {

/// All keys. Paths are read and printed as they are. Reads a configuration with one axis, or none if `by_axes` is true.
const JsonTable<Config>& config_keys();

/// JSON Schema of a configuration file, with the defaults.
Json config_schema();

}  // namespace prism::config
