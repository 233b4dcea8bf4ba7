// SPDX-License-Identifier: MIT
// Prometheus' text format, version 0.0.4: the one writer of the project.
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

/// A family of metrics: what it is called, by Prometheus' conventions (base units, the unit behind the name, _total for
/// counters), and what it means.
struct Family {
  const char* name;
  Type type;
  const char* help;
};

using Labels = std::vector<std::pair<std::string, std::string>>;

/// Gathers samples in any order; all of a family stand together in the text, families in the order of their names.
class Exposition {
 public:
  /// A value that is not finite is not known, and is left out. Any text can be the value of a label: it is
  /// printable (escape.hpp), 256 bytes of it are kept. A series that is there already is left out: one
  /// that is there twice would void the scrape of all.
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

/// For node_exporter's textfile directory: a scrape sees the old text or the new one. A new file has mode 0644, an
/// existing one keeps its mode; the temporary file does not end in .prom. Errors: as write_text_file().
Result<void> write_exposition(const std::string& path, std::string_view text);

}  // namespace prism::metrics
