// SPDX-License-Identifier: MIT
// Writes Prometheus' text format, version 0.0.4.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace prism::metrics {

enum class Type { kGauge, kCounter };

/// A family of metrics: name by Prometheus' conventions (base units, unit at the end, _total for counters), type and
/// help text.
struct Family {
  const char* name;
  Type type;
  const char* help;
};

using Labels = std::vector<std::pair<std::string, std::string>>;

/// Collects samples in any order; writes them by family, sorted by name.
class Exposition {
 public:
  /// Skips values that are not finite (unknown). A label may have any text: it is made printable (escape.hpp) and
  /// truncated to 256 bytes. Skips a series that exists already, because a duplicate makes the complete scrape invalid.
  void add(const Family& family, const Labels& labels, double value);
  std::string text() const;

 private:
  struct Samples {
    Type type;
    std::string help, lines;
    std::set<std::string> series = {};
  };
  std::map<std::string, Samples> families_;
};

/// Writes the text atomically, for node_exporter's textfile directory. A new file has mode 0644, an existing one keeps
/// its mode; the temporary file does not end in .prom. Errors: as write_text_file().
Result<void> write_exposition(const std::string& path, std::string_view text);

}  // namespace prism::metrics
