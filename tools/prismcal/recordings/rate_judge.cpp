// SPDX-License-Identifier: MIT
#include "tools/prismcal/recordings/rate_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "base/plain_text.hpp"
#include "compensation/evaluation/far_runs.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/sample.hpp"
#include "tools/prismcal/recordings/second_judge.hpp"

namespace prism::recordings {
namespace {

using evaluation::FarRun;

/// Rows [begin, end) that are not used.
struct Rows {
  std::size_t begin = 0, end = 0;
};

class RateJudge {
 public:
  RateJudge(std::vector<double>& rates, const RateJudgement& judgement) : rates_(rates), judgement_(judgement) {
    constexpr std::size_t kMostBlocks = 200'000;
    size_ = (rates.size() + kMostBlocks - 1) / kMostBlocks;
    find_means();
  }

  std::vector<std::string> run() {
    constexpr std::size_t kEnough = 50;
    if (means_.size() < kEnough) return {};
    find_far();
    find_stopped();
    for (const Rows& rows : left_out_) {
      std::fill(rates_.begin() + static_cast<std::ptrdiff_t>(rows.begin),
                rates_.begin() + static_cast<std::ptrdiff_t>(rows.end), kUnknown);
    }
    return std::move(notes_);
  }

 private:
  /// Means of blocks of size_ rows, without those that have no value.
  void find_means() {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t row = 0; row < rates_.size(); ++row) {
      if (std::isfinite(rates_[row])) sum += rates_[row], ++count;
      if ((row + 1) % size_ != 0 && row + 1 != rates_.size()) continue;
      if (count > 0) means_.push_back(sum / static_cast<double>(count)), block_.push_back(row / size_);
      sum = 0, count = 0;
    }
  }

  void find_far() {
    const auto limits = far_rate_limits(means_, judgement_.unit_deg_per_h, judgement_.interval_s * size());
    const std::vector<FarRun> runs = evaluation::far_runs(means_, limits);
    for (const FarRun& run : runs) {
      const Rows rows = far_rows(run);
      if (&run - runs.data() < static_cast<std::ptrdiff_t>(evaluation::kFewRuns)) note_far(rows, run.rest);
      left_out_.push_back(rows);
    }
    if (runs.size() > evaluation::kFewRuns)
      notes_.push_back(fmt::format("rate: {} more at {:.6g} deg/h: not used",
                                   counted(runs.size() - evaluation::kFewRuns, "run"),
                                   level_of(left_out_.front()) * judgement_.unit_deg_per_h));
    for (auto run = runs.rbegin(); run != runs.rend(); ++run) {
      means_.erase(means_.begin() + static_cast<std::ptrdiff_t>(run->begin),
                   means_.begin() + static_cast<std::ptrdiff_t>(run->end));
      block_.erase(block_.begin() + static_cast<std::ptrdiff_t>(run->begin),
                   block_.begin() + static_cast<std::ptrdiff_t>(run->end));
    }
  }

  void find_stopped() {
    constexpr double kStopped_s = 60;
    const auto least = static_cast<std::size_t>(std::max(60.0, kStopped_s / (judgement_.interval_s * size())));
    for (const auto& run : evaluation::constant_runs(means_, least)) {
      if (!run.certain) continue;
      const double level = means_[run.begin];
      const Rows rows =
          rows_between(run.begin, run.end, [level](double rate) { return evaluation::equal_means(rate, level); });
      notes_.push_back(fmt::format(
          "rate is constant at {:.6g} deg/h from {} to {}: a stopped sensor or a code for no value; these values are "
          "not used",
          level * judgement_.unit_deg_per_h, judgement_.time_of(rows.begin), judgement_.time_of(rows.end - 1)));
      left_out_.push_back(rows);
    }
  }

  double size() const { return static_cast<double>(size_); }

  /// From the first to the last row of the blocks [begin, end), and the blocks next to them, that is one of the run.
  template <class IsOne>
  Rows rows_between(std::size_t begin, std::size_t end, IsOne&& is_one) const {
    const std::size_t from = block_[begin] * size_ - std::min(block_[begin] * size_, size_ - 1),
                      to = std::min(rates_.size(), (block_[end - 1] + 2) * size_ - 1);
    const std::span<const double> values(rates_.data() + from, to - from);
    const auto first = std::find_if(values.begin(), values.end(), is_one);
    const auto last = std::find_if(values.rbegin(), values.rend(), is_one);
    if (first == values.end()) return {block_[begin] * size_, std::min(rates_.size(), (block_[end - 1] + 1) * size_)};
    return {from + static_cast<std::size_t>(first - values.begin()),
            to - static_cast<std::size_t>(last - values.rbegin())};
  }

  /// The mean of a block may have few rows of the run: the farthest row decides.
  Rows far_rows(const FarRun& run) const {
    double farthest = 0;
    rows_between(run.begin, run.end, [&](double rate) {
      if (std::isfinite(rate)) farthest = std::max(farthest, std::fabs(rate - run.rest));
      return false;
    });
    return rows_between(run.begin, run.end, [&](double rate) { return std::fabs(rate - run.rest) > farthest / 2; });
  }

  /// Median of the rows in the middle.
  double level_of(const Rows& rows) const {
    const std::size_t some = std::min<std::size_t>(rows.end - rows.begin, 1001);
    const double* const first = rates_.data() + rows.begin + (rows.end - rows.begin - some) / 2;
    std::vector<double> values(first, first + some);
    std::erase_if(values, [](double rate) { return !std::isfinite(rate); });
    return evaluation::median_of(std::move(values));
  }

  void note_far(const Rows& rows, double rest) {
    const double unit = judgement_.unit_deg_per_h;
    const FarRun run{rows.begin, rows.end, level_of(rows) * unit, rest * unit};
    notes_.push_back(far_rate_text(run, counted(rows.end - rows.begin, "row"), judgement_.time_of(rows.begin),
                                   judgement_.time_of(rows.end - 1)));
  }

  std::vector<double>& rates_;
  const RateJudgement& judgement_;
  std::size_t size_ = 1;  ///< rows of a block
  std::vector<double> means_;
  std::vector<std::size_t> block_;  ///< of each mean
  std::vector<Rows> left_out_;
  std::vector<std::string> notes_;
};

}  // namespace

RateJudgement judgement_of(const tables::PlainTable& table, double unit_deg_per_h, std::size_t rows,
                           const std::vector<std::int64_t>& stamps_ns) {
  RateJudgement judgement;
  judgement.unit_deg_per_h = unit_deg_per_h;
  if (stamps_ns.size() > 1 && stamps_ns.back() > stamps_ns.front())
    judgement.interval_s =
        static_cast<double>(stamps_ns.back() - stamps_ns.front()) / 1e9 / static_cast<double>(rows - 1);
  judgement.time_of = [&stamps_ns, is_date = table.has_dates()](std::size_t row) {
    if (row >= stamps_ns.size()) return fmt::format("row {}", row + 1);
    constexpr double kMs_ns = 1e6;
    return tables::time_text(std::llround(static_cast<double>(stamps_ns[row]) / kMs_ns) * 1'000'000, is_date);
  };
  return judgement;
}

std::vector<std::string> judge_rates(std::vector<double>& rates, const RateJudgement& judgement) {
  return RateJudge(rates, judgement).run();
}

}  // namespace prism::recordings
