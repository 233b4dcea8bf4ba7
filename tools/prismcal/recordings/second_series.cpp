// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/second_series.hpp"

#include <algorithm>

namespace prism::recordings {

void SecondSeries::push(std::int64_t second, double rate) {
  if (runs_.empty() || second != last_second() + 1) runs_.push_back({second, size()});
  rates_.push_back(rate);
}

std::int64_t SecondSeries::last_second() const {
  return runs_.back().second + static_cast<std::int64_t>(size() - 1 - runs_.back().index);
}

std::size_t SecondSeries::run_of(std::size_t index) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), index,
                                      [](std::size_t wanted, const Run& run) { return wanted < run.index; });
  return static_cast<std::size_t>(after - runs_.begin()) - 1;
}

std::int64_t SecondSeries::second(std::size_t index) const {
  const Run& run = runs_[run_of(index)];
  return run.second + static_cast<std::int64_t>(index - run.index);
}

std::optional<std::size_t> SecondSeries::find(std::int64_t second) const {
  const auto after = std::upper_bound(runs_.begin(), runs_.end(), second,
                                      [](std::int64_t wanted, const Run& run) { return wanted < run.second; });
  if (after == runs_.begin()) return std::nullopt;
  const Run& run = *(after - 1);
  const std::size_t index = run.index + static_cast<std::size_t>(second - run.second);
  return index < (after == runs_.end() ? size() : after->index) ? std::optional(index) : std::nullopt;
}

}  // namespace prism::recordings
