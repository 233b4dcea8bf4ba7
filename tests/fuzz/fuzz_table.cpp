// SPDX-License-Identifier: MIT
// Any bytes as a plain table: rejected in one line, or read with as many values in each row as columns.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

#include "drivers/shown_bytes.hpp"
#include "tests/fuzz/require.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace {

void check(const prism::Error& error) { require(error.text().find('\n') == std::string::npos); }

void read(const std::string& path, bool with_time) {
  auto table = prism::tables::PlainTable::open(path, {});
  if (!table) return check(table.error());
  prism::tables::Selection selection;
  for (std::size_t i = 0; i < table->columns().size(); ++i) selection.numbers.push_back(i);
  const auto time = table->time_column();
  if (with_time && time) selection.time = prism::tables::TimeSelection{*time};
  if (auto good = table->select(selection); !good) return check(good.error());
  prism::tables::Row row;
  while (true) {
    const auto more = table->next(row);
    if (!more) return check(more.error());
    if (!*more) break;
    require(row.values.size() == selection.numbers.size());
  }
  require(!table->understood().empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string path = "/dev/shm/prism-fuzz-table-" + std::to_string(getpid());
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
  read(path, false);
  read(path, true);
  if (const auto kind = prism::drivers::has_sentences(path, text); !kind) check(kind.error());
  unlink(path.c_str());
  return 0;
}
