// SPDX-License-Identifier: MIT
#include "tools/prismcal/analysis/experiment_meanings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tools/prismcal/analysis/experiment_report.hpp"

namespace prism::analysis {
namespace {

const ExperimentRow* lowest(const std::vector<const ExperimentRow*>& rows) {
  const auto best = std::min_element(rows.begin(), rows.end(), [](const ExperimentRow* a, const ExperimentRow* b) {
    return on_repeat(*a).after.sd < on_repeat(*b).after.sd;
  });
  return best == rows.end() ? nullptr : *best;
}

std::string name_of(const ExperimentRow& row) { return method_text(row.spec) + " on " + row.spec.inputs_text(); }

double improvement(const ModelEvaluation& evaluated) { return evaluated.stability.improvement.value_or(0); }

double worst_case(const ExperimentRow& row) {
  double worst = 1;
  for (const ModelEvaluation& evaluated : row.evaluations) worst = std::min(worst, improvement(evaluated));
  return worst;
}

double mean_case(const ExperimentRow& row) {
  double sum = 0;
  for (const ModelEvaluation& evaluated : row.evaluations) sum += improvement(evaluated);
  return sum / static_cast<double>(row.evaluations.size());
}

}  // namespace

std::string best_meaning(const std::vector<const ExperimentRow*>& rows) {
  const ExperimentRow* best = lowest(rows);
  if (best == nullptr) return "No such model was trained.";
  const auto worst = std::max_element(rows.begin(), rows.end(), [](const ExperimentRow* a, const ExperimentRow* b) {
    return on_repeat(*a).after.sd < on_repeat(*b).after.sd;
  });
  std::string text = fmt::format("For this gyro {} is best on the repeat run, with {:.1f} %", name_of(*best),
                                 100 * improvement(best->evaluations.front()));
  if (rows.size() > 1)
    text += fmt::format("; the worst of these models has {:.1f} %", 100 * improvement((*worst)->evaluations.front()));
  return text + ".";
}

std::string fit_meaning(const std::vector<const ExperimentRow*>& rows) {
  const ExperimentRow* best = lowest(rows);
  if (best == nullptr) return "No such model was trained.";
  const double fitted = best->fitted.stability.after.sd, repeat = on_repeat(*best).after.sd;
  const double more = fitted > 0 ? 100 * (repeat / fitted - 1) : 0;
  return fmt::format("{} leaves 1 sigma of {:.5f} deg/h on its training recording and {:.5f} on the repeat run: {}.",
                     name_of(*best), fitted, repeat,
                     more > 10 ? fmt::format("{:.0f} % more on new data, which the training does not show", more)
                               : "what it learned repeats");
}

std::string correlation_meaning(const std::vector<std::string>& names, const std::vector<double>& correlations) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < std::min(names.size(), correlations.size()); ++i) {
    if (std::isfinite(correlations[i]) && (!best || std::abs(correlations[i]) > std::abs(correlations[*best])))
      best = i;
  }
  if (!best) return "No input changes, so none can explain the bias.";
  return fmt::format("A straight line in the {} alone explains {:.0f} % of the bias's variance, more than the others.",
                     names[*best], 100 * correlations[*best] * correlations[*best]);
}

std::string terms_meaning(const std::vector<const ExperimentRow*>& rows) {
  std::string text;
  for (const ExperimentRow* row : rows)
    text +=
        fmt::format("{}{} needs {} terms", text.empty() ? "" : ", ", method_text(row->spec), row->trained.terms.size());
  return text.empty() ? "No such model was trained." : "For this gyro " + text + ".";
}

std::string profiles_meaning(const std::vector<const ExperimentRow*>& rows) {
  if (rows.empty()) return "No model was trained.";
  const auto failing =
      std::count_if(rows.begin(), rows.end(), [](const ExperimentRow* row) { return worst_case(*row) < 0; });
  const auto safest = std::max_element(rows.begin(), rows.end(), [](const ExperimentRow* a, const ExperimentRow* b) {
    return worst_case(*a) < worst_case(*b);
  });
  return fmt::format(
      "{} of {} models are worse than none on at least one recording; the safest is {}, with at least "
      "{:.1f} % on each.",
      failing, rows.size(), name_of(**safest), 100 * worst_case(**safest));
}

std::string tuning_meaning(const std::vector<const ExperimentRow*>& rows) {
  if (rows.empty()) return "No kernel with all inputs was trained.";
  const auto best = std::max_element(rows.begin(), rows.end(), [](const ExperimentRow* a, const ExperimentRow* b) {
    return mean_case(*a) < mean_case(*b);
  });
  const auto worst = std::min_element(rows.begin(), rows.end(), [](const ExperimentRow* a, const ExperimentRow* b) {
    return mean_case(*a) < mean_case(*b);
  });
  return fmt::format(
      "Over all recordings, {} tuned by {} is best ({:.1f} % on average), {} tuned by {} worst ({:.1f} %).",
      method_text((*best)->spec), tune_text((*best)->spec.tune), 100 * mean_case(**best), method_text((*worst)->spec),
      tune_text((*worst)->spec.tune), 100 * mean_case(**worst));
}

std::string surface_meaning(const std::vector<SurfacePoint>& surface) {
  constexpr double kAlmost = 1.05, kFlat = 0.1;
  if (surface.empty()) return "The grid has no points.";
  double lowest_cost = surface.front().cost_deg_per_h;
  for (const SurfacePoint& point : surface) lowest_cost = std::min(lowest_cost, point.cost_deg_per_h);
  const auto good = std::count_if(surface.begin(), surface.end(), [&](const SurfacePoint& point) {
    return point.cost_deg_per_h <= kAlmost * lowest_cost;
  });
  const double share = static_cast<double>(good) / static_cast<double>(surface.size());
  return fmt::format(
      "{:.0f} % of the grid cost at most 5 % more than the best point: {}.", 100 * share,
      share > kFlat ? "the exact values of c and sigma2 hardly matter" : "c and sigma2 are well determined");
}

}  // namespace prism::analysis
