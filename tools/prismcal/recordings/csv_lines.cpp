// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/csv_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace prism::recordings {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto dropped = [](char c) { return c == ' ' || c == '"' || c == '\r'; };
  while (!text.empty() && dropped(text.front())) text.remove_prefix(1);
  while (!text.empty() && dropped(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

Result<CsvLines> CsvLines::open(const std::string& path) {
  auto in = FileReader::open(path);
  if (!in) return tl::unexpected<Error>(in.error());
  return CsvLines(std::move(*in), path);
}

bool CsvLines::next() {
  while (in_.read_line(line_)) {
    if (++number_ == 1 && line_.starts_with("\xEF\xBB\xBF")) line_.erase(0, 3);
    if (!line_.empty() && line_.back() == '\r') line_.pop_back();
    if (line_.empty()) continue;
    if (line_.front() == '#') {
      comments_ += line_ + '\n';
      continue;
    }
    if (separator_ == 0) {
      constexpr std::string_view kSeparators = ",;\t";
      const std::size_t at = kSeparators.find_first_of(line_);
      separator_ = at == std::string_view::npos ? ',' : kSeparators[at];
    }
    return true;
  }
  return false;
}

std::string CsvLines::position() const { return fmt::format("{}:{}", where_, number_); }

std::size_t CsvLines::field_count() const {
  return static_cast<std::size_t>(std::count(line_.begin(), line_.end(), separator_)) + 1;
}

std::optional<std::string_view> csv_field(std::string_view line, char separator, std::size_t index) {
  for (; index > 0; --index) {
    const std::size_t end = line.find(separator);
    if (end == std::string_view::npos) return std::nullopt;
    line.remove_prefix(end + 1);
  }
  return trimmed(line.substr(0, line.find(separator)));
}

std::vector<std::string> csv_fields(std::string_view line, char separator) {
  std::vector<std::string> fields;
  for (std::size_t i = 0; !line.empty(); ++i) {
    const auto field = csv_field(line, separator, i);
    if (!field) break;
    fields.emplace_back(*field);
  }
  return fields;
}

std::optional<std::size_t> csv_column(const std::vector<std::string>& names, const std::string& wanted) {
  const auto named = std::find(names.begin(), names.end(), wanted);
  if (named != names.end()) return static_cast<std::size_t>(named - names.begin());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::to_string(i + 1) == wanted) return i;
  }
  return std::nullopt;
}

std::optional<double> csv_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0;
  const char* const last = field.data() + field.size();
  const auto [end, error] = std::from_chars(field.data(), last, value);
  if (error != std::errc() || end != last || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace prism::recordings
