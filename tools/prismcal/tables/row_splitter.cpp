// SPDX-License-Identifier: MIT
#include "tools/prismcal/tables/row_splitter.hpp"

#include <new>

namespace prism::tables {
namespace {

constexpr char kNoSeparator = '\x1f';  // the unit separator of ASCII: in no table

/// One blank for each run of blanks and tabs outside quotes; none at the ends.
void join_blanks(std::string_view line, std::string& out) {
  out.clear();
  bool quoted = false, blank = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == ' ' || c == '\t')) {
      blank = !out.empty();
      continue;
    }
    if (blank) out.push_back(' ');
    blank = false;
    out.push_back(c);
  }
}

}  // namespace

RowSplitter::RowSplitter(char separator) : separator_(separator) {
  if (csv_init(&parser_, 0) != 0) throw std::bad_alloc();
  csv_set_delim(&parser_, static_cast<unsigned char>(separator == 0 ? kNoSeparator : separator));
}

RowSplitter::~RowSplitter() { csv_free(&parser_); }

void RowSplitter::begin() {
  text_.clear();
  ends_.clear();
  complete_ = false;
}

bool RowSplitter::push(std::string_view line) {
  if (!open_) begin();
  if (separator_ == ' ') {
    join_blanks(line, blanks_);
    line = blanks_;
  }
  const auto on_cell = [](void* bytes, std::size_t size, void* self) {
    auto* const splitter = static_cast<RowSplitter*>(self);
    splitter->text_.append(static_cast<const char*>(bytes), size);
    splitter->ends_.push_back(splitter->text_.size());
  };
  const auto on_row = [](int, void* self) { static_cast<RowSplitter*>(self)->complete_ = true; };
  csv_parse(&parser_, line.data(), line.size(), on_cell, on_row, this);
  last_is_quoted_ = line.ends_with('"');
  csv_parse(&parser_, "\n", 1, on_cell, on_row, this);
  open_ = !complete_ && (parser_.quoted != 0 && parser_.pstate != 0);
  return complete_;
}

std::vector<std::string> RowSplitter::cells() const {
  std::vector<std::string> out;
  out.reserve(size());
  for (std::size_t i = 0; i < size(); ++i) out.emplace_back(cell(i));
  return out;
}

}  // namespace prism::tables
