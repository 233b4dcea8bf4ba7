// SPDX-License-Identifier: MIT
// Time to read a plain table: rows a second of processor time, and the memory it takes, relative to
// counting its lines.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>

#include "base/file.hpp"
#include "tools/prismcal/plain_table.hpp"

namespace prism::bench {
namespace {

constexpr std::size_t kRows = 3'000'000;

double cpu_s() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

long resident_kb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

struct Form {
  const char* name;
  char separator, decimal;
  bool dates;
};

void write(const std::string& path, const Form& form) {
  std::ofstream out(path, std::ios::binary);
  out << fmt::format("time{0}rate [deg/h]{0}T [degC]{0}U [V]\n", form.separator);
  for (std::size_t i = 0; i < kRows; ++i) {
    const std::size_t ms = i * 10;
    const std::string time = form.dates ? fmt::format("2024-03-{:02} {:02}:{:02}:{:02}.{:03}", 1 + ms / 86400000 % 30,
                                                      ms / 3600000 % 24, ms / 60000 % 60, ms / 1000 % 60, ms % 1000)
                                        : fmt::format("{:.3f}", 0.01 * static_cast<double>(i));
    std::string row =
        fmt::format("{}{}{:.5f}{}{:.3f}{}{:.4f}\n", time, form.separator, 8.4 + 1e-5 * static_cast<double>(i % 9973),
                    form.separator, 20 + 1e-3 * static_cast<double>(i % 60000), form.separator, 1.2);
    if (form.decimal == ',') std::replace(row.begin(), row.end(), '.', ',');
    out << row;
  }
}

double read_s(const std::string& path) {
  const double begin = cpu_s();
  auto table = tables::PlainTable::open(path, {});
  if (!table) {
    fmt::print("{}\n", table.error().text());
    return 1e300;
  }
  auto good = table->select({{1, 2, 3}, tables::TimeSelection{0, "s"}});
  tables::Row row;
  std::size_t rows = 0;
  while (good) {
    const auto more = table->next(row);
    if (!more || !*more) break;
    ++rows;
  }
  if (rows != kRows) fmt::print("found {} rows, expected {}\n", rows, kRows);
  return cpu_s() - begin;
}

double lines_s(const std::string& path) {
  const double begin = cpu_s();
  auto in = FileReader::open(path);
  std::string line;
  while (in && in->read_line(line)) continue;
  return cpu_s() - begin;
}

int run(const std::string& folder) {
  fmt::print("tables of {} rows, 4 columns (target: 1 million rows/s, constant memory)\n", kRows);
  for (const Form& form : {Form{"comma, numbers", ',', '.', false},
                           {"semicolon, decimal comma", ';', ',', false},
                           {"tab, dates", '\t', '.', true}}) {
    const std::string path = folder + "/table.csv";
    write(path, form);
    const double floor = lines_s(path), seconds = read_s(path);
    fmt::print("{:<26} {:.2f} million rows/s, {:.1f} times reading its lines; {} MB resident at most\n", form.name,
               1e-6 * static_cast<double>(kRows) / seconds, seconds / floor, resident_kb() / 1024);
    std::remove(path.c_str());
  }
  return 0;
}

}  // namespace
}  // namespace prism::bench

int main(int argc, char** argv) { return argc == 2 ? prism::bench::run(argv[1]) : 64; }
