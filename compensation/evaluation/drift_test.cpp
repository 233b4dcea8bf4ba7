// SPDX-License-Identifier: MIT
#include "compensation/evaluation/drift_test.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

constexpr double kYear_h = 8766, kMostOfNeighbours = 0.8;
constexpr std::size_t kFewest = 100, kMostStep = 300, kFewestRecordings = 3;
// Of the simulation: years without a shift, and shifts after kLevel_h.
constexpr double kFewestYears = 10, kMostYears = 40, kFewestShifts = 100, kMostShifts = 500, kMostValues = 13e6;
constexpr int kParts = 10, kLongest = 20'000;

/// Values of a recording, from `begin` to `end` (one past the last), and their mean.
struct Recording {
  std::size_t begin, end;
  double mean;
};

/// Subtracts the mean of each recording.
std::vector<Recording> centre(Residuals& residuals) {
  std::vector<double>& values = residuals.deg_per_h;
  std::vector<Recording> all;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    double sum = 0;
    while (end < values.size() && residuals.recordings[end] == residuals.recordings[begin]) sum += values[end++];
    all.push_back({begin, end, sum / static_cast<double>(end - begin)});
    for (std::size_t i = begin; i < end; ++i) values[i] -= all.back().mean;
  }
  return all;
}

/// Every n-th, so that neighbours correlate by at most kMostOfNeighbours.
void decimate(Residuals& residuals) {
  Residuals centred = residuals;
  (void)centre(centred);
  const auto found = autocorrelate(centred.deg_per_h, std::min(kMostStep, residuals.deg_per_h.size() / 10));
  if (!found) return;
  std::size_t step = 1;
  while (step + 1 < found->coefficient.size() && found->coefficient[step] > kMostOfNeighbours) ++step;
  for (std::size_t i = 0; i * step < residuals.deg_per_h.size(); ++i) {
    residuals.deg_per_h[i] = residuals.deg_per_h[i * step];
    residuals.recordings[i] = residuals.recordings[i * step];
  }
  residuals.deg_per_h.resize((residuals.deg_per_h.size() + step - 1) / step);
  residuals.recordings.resize(residuals.deg_per_h.size());
  residuals.every *= static_cast<int>(step);
}

/// An endless quiet log: whole recordings in any order, each with its switch-on, since errors follow the time since it;
/// of fewer than kFewestRecordings, moving blocks, with a switch-on and its offset each day.
class Quiet {
 public:
  Quiet(const std::vector<double>& centred, std::vector<Recording> recordings, double block, long long day,
        double offset_sd)
      : centred_(centred),
        recordings_(std::move(recordings)),
        block_(static_cast<std::size_t>(block)),
        day_(day),
        offset_(0, offset_sd) {}

  long long day() const { return day_; }
  /// Pushes the next value.
  int feed(DriftTest& test, double shift) {
    const bool is_whole = recordings_.size() >= kFewestRecordings;
    if (is_whole ? at_ == end_ : count_++ % day_ == 0) {
      now_ = offset_(random_);
      test.switch_on();
    }
    if (at_ == end_ && is_whole) {
      const Recording& next = recordings_[random_() % recordings_.size()];
      at_ = next.begin, end_ = next.end, now_ = next.mean;
    } else if (at_ == end_) {
      at_ = random_() % centred_.size();
      end_ = at_ + block_;
    }
    return test.push(now_ + centred_[at_++ % centred_.size()] + shift);
  }

 private:
  const std::vector<double>& centred_;
  std::vector<Recording> recordings_;
  std::size_t block_, at_ = 0, end_ = 0;
  long long day_, count_ = 0;
  double now_ = 0;
  std::normal_distribution<double> offset_;
  std::mt19937_64 random_;
};

/// The threshold with one alarm a year. A month in which a sum reaches n times the threshold has n alarms.
double threshold_of(compensation::MonitorSettings settings, Quiet quiet, double values_per_h) {
  settings.threshold = std::numeric_limits<double>::infinity();
  const double values = kYear_h * values_per_h / 12,
               years = std::clamp(kMostValues / values / 12, kFewestYears, kMostYears);
  std::vector<double> highest;  // sums of each month
  for (int year = 0; year < years; ++year) {
    DriftTest test(settings, 0, values_per_h);
    for (int month = 0; month < 12; ++month) {
      highest.push_back(0);
      for (long long left = std::llround(values); left > 0; --left) {
        (void)quiet.feed(test, 0);
        highest.back() = std::max({highest.back(), test.up(), test.down()});
      }
    }
  }
  double threshold = 1;
  const auto alarms = [&] {
    return std::accumulate(highest.begin(), highest.end(), 0.0,
                           [&](double sum, double one) { return sum + std::floor(one / threshold); });
  };
  while (alarms() > years) threshold *= 1.01;
  return threshold;
}

/// Values after which a shift of 1 sd is found in the mean, with a switch-on a day; at least half of what 98 % need.
/// The shift follows the time that shows the level.
double delay_of(const compensation::MonitorSettings& settings, const Quiet& quiet, double values_per_h) {
  const double level = DriftTest::kLevel_h * values_per_h;
  const auto shifts = static_cast<std::size_t>(std::clamp(kMostValues / 4 / level, kFewestShifts, kMostShifts));
  std::vector<int> delays;
  double sum = 0;
  Quiet log = quiet;
  for (std::size_t shift = 0; shift < shifts; ++shift) {
    DriftTest test(settings, 0, values_per_h);
    const auto before =
        std::llround(level) + static_cast<long long>(shift) * quiet.day() / static_cast<long long>(shifts);
    for (long long i = 0; i < before; ++i) (void)log.feed(test, 0);
    const double moved = shift % 2 ? settings.sd_deg_per_h : -settings.sd_deg_per_h;
    int delay = 1;
    while (moved * log.feed(test, moved) <= 0 && delay < kLongest) ++delay;
    delays.push_back(delay);
    sum += delay;
  }
  std::sort(delays.begin(), delays.end());
  return std::max(sum / static_cast<double>(shifts), 0.5 * delays[shifts * 98 / 100]);
}

}  // namespace

DriftTest::DriftTest(const compensation::MonitorSettings& settings, double mount_sd_deg_per_h, double values_per_h)
    : settings_(settings),
      most_offset_(std::min(kOffsets * settings.offset_deg_per_h, kMostOffset * settings.sd_deg_per_h)),
      most_level_(kOffsets * std::hypot(mount_sd_deg_per_h, settings.offset_deg_per_h)),
      values_per_h_(values_per_h) {}

void DriftTest::switch_on() { sum_ = count_ = 0; }

int DriftTest::push(double difference_deg_per_h) {
  const auto mean = [this](double sum, double count, double most) {
    return std::clamp(sum / (count + values_per_h_), -most, most);
  };
  const double difference = difference_deg_per_h - mean(first_sum_, first_count_, most_level_);
  const double z = (difference - mean(sum_, count_, most_offset_)) / settings_.sd_deg_per_h;
  if (first_count_ < kLevel_h * values_per_h_) first_sum_ += difference_deg_per_h, ++first_count_;
  sum_ += difference;
  ++count_;
  up_.add(z - kAllowance);
  down_.add(-z - kAllowance);
  const bool is_up = up_.sum > settings_.threshold;
  if (!is_up && down_.sum <= settings_.threshold) return 0;
  const int length = is_up ? up_.length : -down_.length;
  up_ = down_ = {};
  return length;
}

std::optional<compensation::MonitorSettings> monitor_settings(Residuals residuals, double offset_sd_deg_per_h,
                                                              double least_sd_deg_per_h) {
  if (residuals.deg_per_h.size() < kFewest) return std::nullopt;
  decimate(residuals);
  std::vector<Recording> recordings = centre(residuals);
  const std::vector<double>& record = residuals.deg_per_h;
  const auto summary = summarise(record, Divisor::kN);
  if (!summary || !(summary->sd > 0)) return std::nullopt;
  compensation::MonitorSettings settings;
  settings.every = residuals.every;
  settings.sd_deg_per_h = std::max(summary->sd, least_sd_deg_per_h);
  Residuals parts = residuals;
  for (std::size_t i = 0; i < record.size(); ++i)
    parts.recordings[i] = static_cast<int>((kParts * (i + 1) - 1) / record.size());
  std::vector<double> means;
  for (const Recording& one : recordings.size() < kFewestRecordings ? centre(parts) : recordings)
    means.push_back(one.mean);
  settings.offset_deg_per_h = std::max(offset_sd_deg_per_h, summarise(means, Divisor::kNMinus1).value().sd);
  settings.correlation = neighbour_correlation(record);
  const double values_per_h = 3600 / (residuals.window_s * residuals.every), day = 24 * values_per_h;
  const auto n = static_cast<double>(record.size());
  const double block = std::max(1.0, std::min(day, n / kParts));
  const Quiet quiet(record, std::move(recordings), block, std::max(1LL, std::llround(day)), settings.offset_deg_per_h);
  // The variance of a block's mean has the relative variance 4/3 of block / n, and the rate of alarms falls by exp(−8)
  // up to the threshold: of many records the mean rate is that of this larger threshold.
  settings.threshold = (1 + 4 * block / n) * threshold_of(settings, quiet, values_per_h);
  settings.delay_h = delay_of(settings, quiet, values_per_h) / values_per_h;
  return settings;
}

}  // namespace prism::evaluation
