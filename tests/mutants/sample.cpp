// SPDX-License-Identifier: MIT
// Code for tools/mutants --self-test: faults.txt lists every fault that may be made here. Each reached fault changes
// the output.
#include <array>
#include <cassert>
#include <chrono>
#include <cstdio>
#include <optional>
#include <string>

namespace {

constexpr int kCount = 3;                       // a constant expression: no fault
const std::array<double, 2> kTable = {1.5, 2};  // static storage: no fault
static_assert(kCount + 1 == 4);
constexpr auto kSum = [] { return kCount + 2; }();
const std::array<int (*)(int), 1> kActions = {[](int n) { return n * 3; }};  // a function of a table: faults
enum class Level { kLow = 1, kHigh = 2 };

#define TWICE(x) ((x) + (x))

struct Settings {
  int length_s = 100;
  unsigned bits : 3 = 1;
  static constexpr bool kOn = true;
};

constexpr int below(int a, int b) { return a < b ? 7 : 8; }
static_assert(below(1, 2) == 7);

template <int kSize>
int sized(const std::array<int, kSize>& all) {
  int sum = 0;
  for (const int each : all) sum += each;
  return sum;
}

int early(int value) {
  if (value > 4) return 1;
  if (value == 4) {
    std::printf("four\n");
    return 2;
  } else {
    std::printf("not four\n");
  }
  if (value >= 2) {
    std::printf("two\n");
    return 13;
  }
  return value;
}

const char* name(Level level) {
  switch (level) {
    case Level::kLow:
      return "low";
    case Level::kHigh:
      break;
  }
  return "high";
}

double scaled(double value, const double* where) {
  [[maybe_unused]] int buffer[4];
  static const double factor = 2.5;
  const int count = 6;
  constexpr double low = 1, high = 2;
  if (value < low || value > high * 100) return value;
  assert(value < 1000);
  const auto pause = std::chrono::seconds(1) + std::chrono::milliseconds(20);
  return -value * 0.25 + *(where + 1) + factor + count + TWICE(1) + static_cast<double>(pause.count());
}

int never(int value) { return value - 1; }

}  // namespace

int main(int count, char**) {
  using std::chrono_literals::operator""s;
  const std::string one = "one";
  const std::optional<int> none;
  std::printf("%d %d %d\n", below(count, count), sized<2>({count, 20}), Settings{}.length_s);
  std::printf("%d %d %d %d\n", early(5), early(4), early(3), early(1));
  std::printf("%s %s\n", name(Level::kLow), name(Level::kHigh));
  std::printf("%g %g\n", scaled(8, kTable.data()), static_cast<double>((90s).count()));
  std::printf("%d %d\n", none.has_value() || one != "two", one == "one" && count < 2);
  if (count > 1'000 || (count > 0x10 && !none)) std::printf("%d\n", never(count));
  auto squares = [](int n) {
    int sum = 0;
    for (int i = 0; i < n; ++i) sum += i * i;
    return sum;
  };
  std::printf("%d\n", squares(4));
  std::printf("%d\n", kActions.front()(kSum));
}
