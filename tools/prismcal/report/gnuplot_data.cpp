// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "tools/prismcal/report/gnuplot.hpp"

namespace prism::report {
namespace {

/// Half-way points between the neighbours of a sorted grid, and as far out at its ends; in log10 where `logarithmic`.
std::vector<double> grid_edges(std::vector<double> values, bool logarithmic) {
  if (logarithmic) std::transform(values.begin(), values.end(), values.begin(), [](double v) { return std::log10(v); });
  std::sort(values.begin(), values.end());
  values.erase(
      std::unique(values.begin(), values.end(), [](double a, double b) { return b - a < 1e-9 * std::abs(b) + 1e-12; }),
      values.end());
  std::vector<double> edges;
  for (std::size_t i = 0; i + 1 < values.size(); ++i) edges.push_back(0.5 * (values[i] + values[i + 1]));
  if (values.size() < 2) return {};
  edges.insert(edges.begin(), 2 * values.front() - edges.front());
  edges.push_back(2 * values.back() - edges.back());
  if (logarithmic) std::transform(edges.begin(), edges.end(), edges.begin(), [](double v) { return std::pow(10, v); });
  return edges;
}

/// The cell of the grid around a value.
std::pair<double, double> cell_around(const std::vector<double>& edges, double value) {
  if (edges.size() < 2) return {value, value};
  const auto above = std::upper_bound(edges.begin() + 1, edges.end() - 1, value);
  return {*(above - 1), *above};
}

/// A surface: one rectangle for each point, as boxxyerror takes them: x y xlow xhigh ylow yhigh value.
void write_heat(std::string& script, const Series& series, const Panel& panel) {
  const auto x_edges = grid_edges(series.x, panel.x.logarithmic), y_edges = grid_edges(series.y, panel.y.logarithmic);
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!std::isfinite(series.high[i])) continue;
    const auto [x0, x1] = cell_around(x_edges, series.x[i]);
    const auto [y0, y1] = cell_around(y_edges, series.y[i]);
    script += fmt::format("{:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g} {:.7g}\n", series.x[i], series.y[i], x0, x1, y0,
                          y1, series.high[i]);
  }
}

/// A value that is not finite becomes an empty line: the curve breaks.
void write_curve(std::string& script, const Series& series) {
  bool any = false;
  for (std::size_t i = 0; i < series.x.size() && i < series.y.size(); ++i) {
    const double high = series.form == Form::kBand && i < series.high.size() ? series.high[i] : 0;
    if (std::isfinite(series.x[i]) && std::isfinite(series.y[i]) && std::isfinite(high)) {
      script += fmt::format("{:.7g} {:.7g} {:.7g}\n", series.x[i], series.y[i], high);
      any = true;
    } else if (any) {
      script += '\n';
    }
  }
  if (!any) script += "NaN NaN NaN\n";
}

}  // namespace

void write_gnuplot_data(std::string& script, const Plot& plot) {
  for (std::size_t p = 0; p < plot.panels.size(); ++p) {
    const Panel& panel = plot.panels[p];
    for (std::size_t s = 0; s < panel.series.size(); ++s) {
      const Series& series = panel.series[s];
      script += fmt::format("$d{}_{} << EOD\n", p, s);
      if (series.form == Form::kHeat) {
        write_heat(script, series, panel);
      } else {
        write_curve(script, series);
      }
      script += "EOD\n";
    }
  }
}

}  // namespace prism::report
