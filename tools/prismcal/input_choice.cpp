// SPDX-License-Identifier: MIT
#include "tools/prismcal/input_choice.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

namespace prism::commands {
namespace {

using training::Rows;

/// Inputs in standard deviations. `moves`: whether each is not constant.
Eigen::MatrixXd in_deviations(const Eigen::MatrixXd& inputs, std::vector<bool>& moves) {
  Eigen::MatrixXd scaled = inputs.transpose();
  for (Eigen::Index i = 0; i < scaled.cols(); ++i) {
    const double mean = scaled.col(i).mean();
    scaled.col(i).array() -= mean;
    const double sd = std::sqrt(scaled.col(i).squaredNorm() / static_cast<double>(scaled.rows()));
    moves.push_back(sd > 1e-9 * (1 + std::abs(mean)));
    if (moves.back()) scaled.col(i) /= sd;
  }
  return scaled.transpose();
}

double gain_percent(const InputSearch& search, const InputSet& set) {
  return 100 * (1 - set.error_deg_per_h / search.without_deg_per_h);
}

}  // namespace

Result<std::vector<std::string>> candidate_inputs(const TrainChoice& choice) {
  constexpr double kSame_degc = 0.02;  // of the thermometer of T itself: their difference would only be rounding
  const recordings::TrainingSetOptions& options = choice.recordings;
  recordings::SourceOptions source = options.source;
  source.several = true;  // the training checks the ranges of --leave-out
  compensation::FeatureDefinition features = options.window();
  const auto loaded = recordings::read_blocks(choice.files.front(), source, options.site, features,
                                              [&](const recordings::Recording& recording) -> Result<void> {
                                                features.sensors = recording.sensors();
                                                return {};
                                              });
  if (!loaded) return tl::unexpected<Error>(loaded.error());
  const auto values = [&](const std::string& input) {
    std::vector<double> known = loaded->table.column(input);
    std::erase_if(known, [](double value) { return std::isnan(value); });
    return known;
  };
  const auto often = [&](const std::vector<double>& known) { return 10 * known.size() > 9 * loaded->table.size(); };
  std::vector<std::string> names = {"T", "dTdt"};
  if (often(values("U"))) names.emplace_back("U");
  for (const SensorName& sensor : features.sensors) {
    const std::string input = sensor.unit == "degC" ? sensor.name + "-T" : sensor.name;
    const std::vector<double> known = values(input);
    const auto differs = [](double value) { return std::abs(value) > kSame_degc; };
    if (!often(known) || (sensor.unit == "degC" && std::none_of(known.begin(), known.end(), differs))) continue;
    names.push_back(input);
    names.push_back("d" + sensor.name + "/dt");
  }
  return names;
}

Result<InputSearch> search_inputs(const training::TrainingData& data) {
  constexpr Eigen::Index kFewestToChoose = 40;
  constexpr int kHeldOutParts = 10;
  constexpr std::size_t kMost = 6;
  if (data.target.size() < kFewestToChoose)
    return make_error("inputs", fmt::format("found {} samples, expected at least {} to choose inputs by",
                                            data.target.size(), kFewestToChoose));
  std::vector<bool> moves;
  const Eigen::MatrixXd inputs = in_deviations(data.inputs, moves);
  const training::Folds parts = training::blocked_folds(training::runs_of(data), kHeldOutParts);
  const auto judge = [&](const std::vector<int>& chosen) {
    training::TermPowers terms = training::second_order_terms(chosen.size());
    terms.insert(terms.begin(), std::vector<int>(chosen.size(), 0));  // the intercept
    const Eigen::MatrixXd columns = training::columns_of(inputs(chosen, Eigen::all), terms);
    const Eigen::VectorXd error = training::held_out(parts, [&](const Rows& rest, const Rows& part) -> Eigen::VectorXd {
      const Eigen::VectorXd fit = columns(rest, Eigen::all).colPivHouseholderQr().solve(data.target(rest));
      return data.target(part) - columns(part, Eigen::all) * fit;
    });
    double squares = 0, scatter = 0;
    std::vector<double> means;
    for (const Rows& part : training::fold_members(parts)) {
      const double own = error(part).squaredNorm();
      squares += own;
      means.push_back(own / static_cast<double>(part.size()));
    }
    const double mean = squares / static_cast<double>(error.size()), count = static_cast<double>(means.size());
    for (const double own : means) scatter += (own - mean) * (own - mean);
    InputSet set;
    for (const int i : chosen) set.inputs.push_back(data.names[static_cast<std::size_t>(i)]);
    set.error_deg_per_h = std::sqrt(mean);
    if (mean > 0 && count > 1)
      set.standard_error_deg_per_h = std::sqrt(scatter / (count - 1) / count) / (2 * set.error_deg_per_h);
    return set;
  };
  const auto better = [](const InputSet& a, const InputSet& b) { return a.error_deg_per_h < b.error_deg_per_h; };
  InputSearch search;
  search.without_deg_per_h = judge({}).error_deg_per_h;
  std::vector<int> left, chosen;
  for (std::size_t i = 0; i < moves.size(); ++i) {
    if (!moves[i]) continue;
    left.push_back(static_cast<int>(i));
    search.alone.push_back(judge({left.back()}));
  }
  if (left.empty()) return make_error("inputs", "found only constant inputs, expected one that changes");
  while (!left.empty() && chosen.size() < kMost) {
    std::vector<InputSet> sets;
    chosen.push_back(-1);
    for (const int candidate : left) {
      chosen.back() = candidate;
      sets.push_back(judge(chosen));
    }
    const auto best = std::min_element(sets.begin(), sets.end(), better);
    const auto which = left.begin() + (best - sets.begin());
    chosen.back() = *which;
    left.erase(which);
    search.path.push_back(std::move(*best));
  }
  const auto best = std::min_element(search.path.begin(), search.path.end(), better);
  const double enough = best->error_deg_per_h + best->standard_error_deg_per_h;
  while (search.path[search.chosen].error_deg_per_h > enough) ++search.chosen;
  return search;
}

std::string search_text(const InputSearch& search) {
  std::string text = fmt::format(
      "inputs, error of second-order polynomials on held-out parts; without inputs {:.5f} deg/h; each input alone\n",
      search.without_deg_per_h);
  const auto line = [&](const std::string& name, const InputSet& set, const char* mark) {
    text += fmt::format("  {:<36} {:.5f} ± {:.5f} deg/h  {:6.1f} %{}\n", name, set.error_deg_per_h,
                        set.standard_error_deg_per_h, gain_percent(search, set), mark);
  };
  for (const InputSet& set : search.alone) line(set.inputs.front(), set, "");
  text += "added one by one, the largest improvement first\n";
  for (std::size_t i = 0; i < search.path.size(); ++i) {
    line((i > 0 ? "+ " : "") + search.path[i].inputs.back(), search.path[i],
         i == search.chosen ? "  chosen: the smallest set within one standard error of the best" : "");
  }
  return text;
}

nlohmann::ordered_json search_json(const InputSearch& search) {
  const auto sets = [&](const std::vector<InputSet>& of) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const InputSet& set : of)
      json.push_back({{"inputs", set.inputs},
                      {"error_deg_per_h", set.error_deg_per_h},
                      {"standard_error_deg_per_h", set.standard_error_deg_per_h},
                      {"gain_percent", gain_percent(search, set)}});
    return json;
  };
  return {{"without_deg_per_h", search.without_deg_per_h},
          {"alone", sets(search.alone)},
          {"path", sets(search.path)},
          {"chosen", search.best().inputs}};
}

}  // namespace prism::commands
