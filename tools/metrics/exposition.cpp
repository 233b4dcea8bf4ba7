// SPDX-License-Identifier: MIT
#include "tools/metrics/exposition.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdint>
#include <iterator>

#include "base/file.hpp"

namespace prism::metrics {
namespace {

std::string escaped(std::string_view text, bool label) {
  std::string result;
  for (const char c : text) {
    if (c == '\\') {
      result += "\\\\";
    } else if (c == '\n') {
      result += "\\n";
    } else if (c == '"' && label) {
      result += "\\\"";
    } else {
      result += c;
    }
  }
  return result;
}

// Counts as they are, everything else with the digits that tell it from its neighbours.
std::string number(double value) {
  if (value == std::floor(value) && std::abs(value) < 9e15) return fmt::format("{}", static_cast<std::int64_t>(value));
  return fmt::format("{}", value);
}

}  // namespace

void Exposition::add(const Family& family, const Labels& labels, double value) {
  if (!std::isfinite(value)) return;
  Samples& own = families_.try_emplace(family.name, Samples{family.type, family.help, ""}).first->second;
  own.lines += family.name;
  for (std::size_t i = 0; i < labels.size(); ++i)
    fmt::format_to(std::back_inserter(own.lines), "{}{}=\"{}\"", i == 0 ? "{" : ",", labels[i].first,
                   escaped(labels[i].second, true));
  if (!labels.empty()) own.lines += '}';
  own.lines += " " + number(value) + "\n";
}

std::string Exposition::text() const {
  std::string text;
  for (const auto& [name, own] : families_)
    text += fmt::format("# HELP {} {}\n# TYPE {} {}\n{}", name, escaped(own.help, false), name,
                        own.type == Type::kCounter ? "counter" : "gauge", own.lines);
  return text;
}

Result<void> write_exposition(const std::string& path, std::string_view text) {
  if (auto written = write_text_file(path, text); !written) return written;
  ::chmod(path.c_str(), 0644);
  return {};
}

}  // namespace prism::metrics
