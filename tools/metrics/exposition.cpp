// SPDX-License-Identifier: MIT
#include "tools/metrics/exposition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::metrics {
namespace {

constexpr std::size_t kMaxLabelBytes = 256;

// Prometheus' escapes. Other control characters have no escape, and readers differ in what they accept, so they are
// made printable.
std::string escaped(std::string_view text, bool label) {
  std::string result;
  for (const char c : printable_lines(text)) {
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

std::string labels_text(const Labels& labels) {
  std::string text;
  for (const auto& [name, value] : labels)
    fmt::format_to(std::back_inserter(text), "{}{}=\"{}\"", text.empty() ? "{" : ",", name,
                   escaped(utf8_prefix(value, kMaxLabelBytes), true));
  return text.empty() ? text : text + "}";
}

// Integers for counts, else as many digits as identify the double.
std::string number(double value) {
  if (value == std::floor(value) && std::abs(value) < 9e15) return fmt::format("{}", static_cast<std::int64_t>(value));
  return fmt::format("{}", value);
}

}  // namespace

void Exposition::add(const Family& family, const Labels& labels, double value) {
  if (!std::isfinite(value)) return;
  Samples& own = families_.try_emplace(family.name, Samples{family.type, family.help, ""}).first->second;
  const auto [series, is_new] = own.series.insert(labels_text(labels));
  if (is_new) own.lines += fmt::format("{}{} {}\n", family.name, *series, number(value));
}

std::string Exposition::text() const {
  std::string text;
  for (const auto& [name, own] : families_)
    text += fmt::format("# HELP {} {}\n# TYPE {} {}\n{}", name, escaped(own.help, false), name,
                        own.type == Type::kCounter ? "counter" : "gauge", own.lines);
  return text;
}

Result<void> write_exposition(const std::string& path, std::string_view text) {
  return write_text_file(path, text, 0644);  // node_exporter is another user
}

}  // namespace prism::metrics
