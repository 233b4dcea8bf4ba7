// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "compensation/evaluation/allan.hpp"
#include "compensation/evaluation/statistics.hpp"

namespace prism::evaluation {
namespace {

constexpr std::size_t kShortestSegment = 64, kLongestSegment = 1 << 16, kMostLines = 10;
constexpr double kKnownShare = 0.95, kFalseLines = 1e-3, kPerDecade = 40;
/// Neighbours of a peak: `kNear` bins at each side are its own, the next `kAround` show the noise.
constexpr std::size_t kNear = 2, kAround = 12;

/// Mean density of each bin but the first, of all segments.
struct Welch {
  std::vector<double> density;
  std::size_t segments = 0;
};

Welch welch(std::span<const double> rate, std::size_t length, double tau0_s) {
  std::vector<double> window(length), values(length);
  for (std::size_t i = 0; i < length; ++i)
    window[i] =
        0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(length));
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> bins;
  Welch found{std::vector<double>(length / 2, 0.0)};
  for (std::size_t begin = 0; begin + length <= rate.size(); begin += length / 2) {
    const auto part = rate.subspan(begin, length);
    double sum = 0, known = 0, weight = 0;
    for (const double value : part) {
      if (std::isfinite(value)) sum += value, ++known;
    }
    if (known < kKnownShare * static_cast<double>(length)) continue;
    for (std::size_t i = 0; i < length; ++i) {
      const bool is_known = std::isfinite(part[i]);
      values[i] = is_known ? (part[i] - sum / known) * window[i] : 0;
      weight += is_known ? window[i] * window[i] : 0;
    }
    transform.fwd(bins, values);
    for (std::size_t k = 1; k < length / 2; ++k) found.density[k] += 2 * tau0_s / weight * std::norm(bins[k]);
    ++found.segments;
  }
  for (double& density : found.density) density /= static_cast<double>(std::max<std::size_t>(1, found.segments));
  return found;
}

std::vector<SpectralLine> lines_in(const Welch& spectrum, double step_hz) {
  const std::vector<double>& density = spectrum.density;
  // Segments that overlap by half are correlated: 1.9 degrees of freedom each instead of 2 (Welch).
  const boost::math::chi_squared square(std::max(2.0, 1.9 * static_cast<double>(spectrum.segments)));
  const double chance = kFalseLines / static_cast<double>(density.size());
  const double most = quantile(complement(square, chance)) / square.degrees_of_freedom();
  const auto noise = [&](std::size_t begin) {
    return median_of({density.begin() + static_cast<std::ptrdiff_t>(begin),
                      density.begin() + static_cast<std::ptrdiff_t>(begin + kAround)});
  };
  std::vector<SpectralLine> lines;
  for (std::size_t k = kNear + kAround + 1; k + kNear + kAround < density.size(); ++k) {
    const auto peak = density.begin() + static_cast<std::ptrdiff_t>(k);
    if (*peak < *std::max_element(peak - kNear, peak + kNear + 1)) continue;
    const double level = std::max(noise(k - kNear - kAround), noise(k + kNear + 1));
    if (!(*peak > most * level)) continue;
    double power = 0, moment = 0;
    for (std::size_t i = k - kNear; i <= k + kNear; ++i) {
      const double above = std::max(0.0, density[i] - level) * step_hz;
      power += above, moment += above * static_cast<double>(i) * step_hz;
    }
    lines.push_back({moment / power, std::sqrt(2 * power)});
  }
  std::sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) { return a.amplitude > b.amplitude; });
  if (lines.size() > kMostLines) lines.resize(kMostLines);
  return lines;
}

}  // namespace

Result<Spectrum> power_spectrum(std::span<const double> rate, double tau0_s, const std::string& where) {
  std::size_t length = kShortestSegment;
  while (length < kLongestSegment && 16 * length <= rate.size()) length *= 2;
  Welch found = welch(rate, length, tau0_s);
  while (found.segments == 0 && length > kShortestSegment) found = welch(rate, length /= 2, tau0_s);
  if (found.segments == 0)
    return make_error(where,
                      fmt::format("found no {} values in a row, expected them for a spectrum", kShortestSegment));
  const double step_hz = 1 / (static_cast<double>(length) * tau0_s);
  Spectrum spectrum;
  spectrum.lines = lines_in(found, step_hz);
  spectrum.segments = found.segments, spectrum.segment_values = length;
  const auto interval = [](std::size_t k) { return std::floor(kPerDecade * std::log10(static_cast<double>(k))); };
  for (std::size_t k = 1, next = 1; k < found.density.size(); k = next) {
    double frequency = 0, density = 0;
    for (; next < found.density.size() && interval(next) == interval(k); ++next)
      frequency += static_cast<double>(next) * step_hz, density += found.density[next];
    spectrum.frequency_hz.push_back(frequency / static_cast<double>(next - k));
    spectrum.density.push_back(density / static_cast<double>(next - k));
  }
  return spectrum;
}

}  // namespace prism::evaluation
