// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/lot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/file.hpp"
#include "base/plain_text.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "config/version.hpp"

namespace prism::campaign {
namespace {

using analysis::Limit, analysis::Measured;
using report::Cell, report::Emphasis, report::general_cell, report::Table;

constexpr std::size_t kMinValues = 8, kMinBins = 4, kBars = 24;
constexpr double kOutlierScore = 3.5;  // robust sd from the median (Iglewicz and Hoaglin 1993)

/// The quantities by which gyros are compared.
struct LotQuantity {
  const char *name, *unit;
};
constexpr std::array<LotQuantity, 6> kLotQuantities{{{"before_deg_per_h", "deg/h"},
                                                     {"bias_stability_deg_per_h", "deg/h"},
                                                     {"improvement_percent", "%"},
                                                     {"hysteresis_gap_deg_per_h", "deg/h"},
                                                     {"within_two_sd_percent", "%"},
                                                     {"mean_of_training_deg_per_h", "deg/h"}}};

// Results.

std::optional<double> number_of(const Json& json, const char* key) {
  return json.contains(key) && json[key].is_number() ? std::optional(json[key].get<double>()) : std::nullopt;
}

TaskResult parse_task_result(const Json& json, const PlannedTask& task) {
  TaskResult result;
  result.task = task.id;
  result.gyro = task.gyro;
  result.model = task.model;  // its current name: the stored one may be older, since the id does not contain it
  result.serial = json.at("serial");
  result.axis = json.at("axis");
  result.level = json.at("level");
  result.version = json.at("version");
  result.refused = json.at("outcome") == "refused";
  if (result.refused) {
    result.why = json.at("why");
    return result;
  }
  result.id = json.at("id");
  result.simulated = json.at("simulated");
  result.data_quality = json.at("data_quality");
  result.mean_deg_per_h = number_of(json.at("training"), "mean_deg_per_h");
  for (const Json& point : json.at("training").at("curve_degc_deg_per_h"))
    result.curve.emplace_back(point.at(0), point.at(1));
  for (const Json& judged : json.at("judged")) {
    RecordingResult recording{judged.at("role"), judged.at("recording"), judged.at("trained_on"), {}};
    for (const auto& item : judged.at("measured").items())
      recording.measured.push_back({item.key(), "", number_of(judged["measured"], item.key().c_str())});
    recording.measured.push_back({"before_deg_per_h", "", number_of(judged, "before_deg_per_h")});
    result.evaluations.push_back(std::move(recording));
  }
  return result;
}

Result<TaskResult> read_task_result(const ResultStore& store, const PlannedTask& task) {
  const std::string path = store.task_folder(task.id) + "/result.json";
  const auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  try {
    return parse_task_result(Json::parse(*text), task);
  } catch (const Json::exception& error) {
    return make_error(
        path, fmt::format("found {}, expected a result of this version; remove its directory to repeat the task",
                          error.what()));
  }
}

void add_violations(const std::string& where, const std::vector<Limit>& limits, const std::vector<Measured>& measured,
                    std::vector<std::string>& violations) {
  for (const analysis::LimitCheck& check : analysis::check_limits(limits, measured)) {
    const auto& value = check.measured.value;
    if (!check.pass)
      violations.push_back(fmt::format("{}: {} {}, expected {}", where, check.limit.quantity,
                                       value ? fmt::format("{:.4g}", *value) : "not measured",
                                       analysis::range_text(check.limit)));
  }
}

void add_quality_violations(const Json& quality, const LotLimits& limits, std::vector<std::string>& violations) {
  const std::string grade = quality.at("verdict");
  std::vector<Measured> found;
  std::vector<std::string> names;
  for (const Json& finding : quality.at("findings")) {
    found.push_back({finding.at("name"), "", number_of(finding, "value")});
    if (finding.at("verdict") != "pass") names.push_back(finding.at("name"));
  }
  if (grade == "refuse" || (grade == "warn" && !limits.warnings_pass))
    violations.push_back(fmt::format("data quality: {} ({}), expected {}", grade, fmt::join(names, ", "),
                                     limits.warnings_pass ? "warn" : "pass"));
  // "quantised" is listed only if the rate has steps.
  std::vector<Limit> applicable = limits.quality;
  std::erase_if(applicable, [&](const Limit& limit) {
    return limit.quantity == "quantised" &&
           std::none_of(found.begin(), found.end(), [](const Measured& m) { return m.quantity == "quantised"; });
  });
  add_violations("data quality", applicable, found, violations);
}

// Comparison of gyros.

struct LotStatistics {
  std::size_t count = 0;
  double min = 0, low = 0, median = 0, high = 0, max = 0;  // low and high: 5th and 95th percentile
  double robust_sd = 0;                                    // 1.4826 × median absolute deviation
};

/// `values` must not be empty.
LotStatistics statistics_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double share) {  // with linear interpolation
    const double position = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const double part = position - static_cast<double>(below);
    return below + 1 < values.size() ? values[below] + part * (values[below + 1] - values[below]) : values.back();
  };
  return {values.size(),
          values.front(),
          quantile(0.05),
          quantile(0.5),
          quantile(0.95),
          values.back(),
          evaluation::robust_sd(values)};
}

std::vector<double> values_of(const std::vector<TaskResult>& results, const std::string& model, const char* quantity) {
  std::vector<double> values;
  for (const TaskResult& result : results) {
    const auto value = result.model == model ? result.value(quantity) : std::nullopt;
    if (value) values.push_back(*value);
  }
  return values;
}

/// Rms difference and correlation of the bias-temperature curves of two gyros.
struct Similarity {
  const TaskResult *one, *other;
  double difference_deg_per_h = 0, correlation = 0;
};
/// Returns nullopt if they have fewer than four common bins.
std::optional<Similarity> compare_curves(const TaskResult& a, const TaskResult& b) {
  std::vector<double> x, y;
  for (const auto& [degc, bias] : a.curve) {
    for (const auto& [other_degc, other] : b.curve) {
      if (degc == other_degc) x.push_back(bias), y.push_back(other);
    }
  }
  if (x.size() < kMinBins) return std::nullopt;
  const auto n = static_cast<double>(x.size());
  const double mean_x = evaluation::neumaier_sum(x) / n, mean_y = evaluation::neumaier_sum(y) / n;
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = x[i] - mean_x, dy = y[i] - mean_y;
    xx += dx * dx, yy += dy * dy, xy += dx * dy;
  }
  return Similarity{&a, &b, std::sqrt(std::max(0.0, xx + yy - 2 * xy) / n),
                    xx > 0 && yy > 0 ? xy / std::sqrt(xx * yy) : 0};
}

// Tables.

Cell gyro_cell(const TaskResult& result, bool pages) {
  Cell cell(result.gyro);
  if (pages && !result.refused) cell.link = fmt::format("../tasks/{}/report/report.html", result.task);
  return cell;
}

Table models_table(const LotFile& file, const Lot& lot) {
  Table table{"models", "The lot by model", "Installed: the first accepted model of each gyro, in this order.",
              report::columns("model: | options: | accepted | rejected | refused | without a result | installed")};
  const auto chosen = lot.chosen(file.models);
  std::set<std::string> gyros;
  for (const ModelChoice& model : file.models) {
    std::size_t accepted = 0, rejected = 0, refused = 0, missing = 0, installed = 0;
    for (const TaskResult& result : lot.results) {
      gyros.insert(result.gyro);
      if (result.model == model.name) ++(result.accepted() ? accepted : result.refused ? refused : rejected);
    }
    for (const MissingTask& task : lot.missing) missing += task.model == model.name;
    for (const TaskResult* result : chosen) installed += result->model == model.name;
    std::vector<Cell> row = {model.name, fmt::format("{}", fmt::join(model.words, " "))};
    for (const std::size_t count : {accepted, rejected, refused, missing, installed})
      row.push_back(report::count_cell(count));
    table.rows.push_back(std::move(row));
  }
  table.meaning = fmt::format("{} of {} have an accepted model.", chosen.size(), counted(gyros.size(), "gyro"));
  return table;
}

Table gyros_table(const LotFile& file, const Lot& lot) {
  Table table{
      "gyros", "Every gyro with every model",
      "Means over the repeat runs; 1 sigma of block means. Each run must meet the limits; a value that could not "
      "be measured fails its limit.",
      report::columns("gyro: | model: | verdict: | repeats | before [deg/h] | after [deg/h] | improvement [%] | "
                      "hysteresis [deg/h] | within 2 sd [%] | by which limit: | id:")};
  std::size_t accepted = 0;
  for (const TaskResult& result : lot.results) {
    accepted += result.accepted();
    const auto value = [&](const char* quantity) { return general_cell(result.value(quantity), 4); };
    table.rows.push_back({gyro_cell(result, file.reports),
                          result.model,
                          {result.accepted() ? "accepted"
                           : result.refused  ? "refused"
                                             : "rejected",
                           result.accepted() ? Emphasis::kGood : Emphasis::kBad},
                          report::count_cell(result.repeats()),
                          value("before_deg_per_h"),
                          value("bias_stability_deg_per_h"),
                          value("improvement_percent"),
                          value("hysteresis_gap_deg_per_h"),
                          value("within_two_sd_percent"),
                          fmt::format("{}", fmt::join(result.violations, "; ")),
                          {result.id.substr(0, 12), Emphasis::kMuted}});
  }
  for (const MissingTask& task : lot.missing) {
    std::vector<Cell> row(table.columns.size(), report::kNothing);
    row[0] = task.gyro, row[1] = task.model, row[2] = {"no result", Emphasis::kWarn};
    row[9] = task.why.empty() ? "not run yet" : task.why;
    table.rows.push_back(std::move(row));
  }
  table.meaning = fmt::format("{} of {} are accepted.", accepted, counted(table.rows.size(), "model"));
  return table;
}

/// The improvements of the first model that has some.
std::string lot_meaning(const LotFile& file, const Lot& lot) {
  for (const ModelChoice& model : file.models) {
    const auto values = values_of(lot.results, model.name, "improvement_percent");
    if (values.empty()) continue;
    const LotStatistics s = statistics_of(values);
    return fmt::format("Model {} improves the median gyro by {:.0f} %, 19 of 20 gyros by {:.0f} % or more.", model.name,
                       s.median, s.low);
  }
  return "No gyro has an improvement.";
}

Table statistics_table(const LotFile& file, const Lot& lot) {
  Table table{
      "spread", "Distributions over the lot", "Robust sd: 1.4826 × median absolute deviation.",
      report::columns("model: | quantity: | unit: | gyros | least | 5 % | median | 95 % | greatest | robust sd")};
  for (const ModelChoice& model : file.models) {
    for (const LotQuantity& quantity : kLotQuantities) {
      const auto values = values_of(lot.results, model.name, quantity.name);
      if (values.empty()) continue;
      const LotStatistics s = statistics_of(values);
      std::vector<Cell> row = {model.name, quantity.name, quantity.unit, report::count_cell(s.count)};
      for (const double value : {s.min, s.low, s.median, s.high, s.max, s.robust_sd})
        row.push_back(general_cell(value, 4));
      table.rows.push_back(std::move(row));
    }
  }
  table.meaning = lot_meaning(file, lot);
  return table;
}

report::Series histogram(const std::string& model, const std::vector<double>& values, double min, double max,
                         std::size_t number) {
  constexpr std::array kInks{report::Ink::kCorrected, report::Ink::kModel, report::Ink::kAccent1, report::Ink::kAccent2,
                             report::Ink::kAccent3};
  report::Series series{model, kInks[number % kInks.size()], report::SeriesStyle::kLinePoints};
  const double width = (max - min) / static_cast<double>(kBars);
  series.y.assign(kBars, 0);
  for (std::size_t i = 0; i < kBars; ++i) series.x.push_back(min + width * (static_cast<double>(i) + 0.5));
  for (const double value : values)
    ++series.y[std::min(kBars - 1, static_cast<std::size_t>(std::max(0.0, (value - min) / width)))];
  return series;
}

/// Histograms from the 1st to the 99th percentile of all models, so that one outlier does not change the bins.
report::Figure statistics_figure(const LotFile& file, const Lot& lot) {
  report::Figure figure{"spread_figure",
                        "Distributions over the lot",
                        "Gyros in each of 24 bins; values outside are counted in the first and last bin.",
                        {}};
  figure.plot.columns = 2;
  for (const LotQuantity& quantity : kLotQuantities) {
    std::vector<std::vector<double>> values;
    std::vector<double> all;
    for (const ModelChoice& model : file.models) {
      values.push_back(values_of(lot.results, model.name, quantity.name));
      all.insert(all.end(), values.back().begin(), values.back().end());
    }
    if (all.size() < 2) continue;
    std::sort(all.begin(), all.end());
    const double min = all[all.size() / 100], max = all[all.size() - 1 - all.size() / 100];
    if (!(max > min)) continue;
    report::Panel panel;
    panel.x.label = fmt::format("{}, {}", quantity.name, quantity.unit);
    std::replace(panel.x.label.begin(), panel.x.label.end(), '_', ' ');
    panel.y.label = "gyros";
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!values[i].empty()) panel.series.push_back(histogram(file.models[i].name, values[i], min, max, i));
    }
    figure.plot.panels.push_back(std::move(panel));
  }
  figure.meaning = lot_meaning(file, lot);
  return figure;
}

Table outliers_table(const LotFile& file, const Lot& lot) {
  Table table{"outliers", "Outliers",
              fmt::format("More than {} robust sd from the median of the lot; for eight or more gyros.", kOutlierScore),
              report::columns("gyro: | model: | quantity: | value | robust sds | verdict:")};
  for (const ModelChoice& model : file.models) {
    for (const LotQuantity& quantity : kLotQuantities) {
      const auto values = values_of(lot.results, model.name, quantity.name);
      if (values.size() < kMinValues) continue;
      const LotStatistics all = statistics_of(values);
      for (const TaskResult& result : lot.results) {
        const auto value = result.model == model.name ? result.value(quantity.name) : std::nullopt;
        const double score = value && all.robust_sd > 0 ? (*value - all.median) / all.robust_sd : 0;
        if (std::abs(score) > kOutlierScore)
          table.rows.push_back({gyro_cell(result, file.reports), model.name, quantity.name, general_cell(value, 4),
                                report::fixed_cell(score, 1), result.accepted() ? "accepted" : "rejected"});
      }
    }
  }
  std::stable_sort(table.rows.begin(), table.rows.end(),
                   [](const auto& a, const auto& b) { return std::abs(*a[4].value) > std::abs(*b[4].value); });
  table.meaning = table.rows.empty() ? "No gyro differs from the lot."
                                     : fmt::format("Look first at gyro {}.", table.rows.front().front().text);
  return table;
}

Table nearest_gyros_table(const LotFile& file, const Lot& lot) {
  Table table{"siblings", "Gyros with similar bias curves",
              "Each gyro and the gyro with the most similar bias against temperature (training recordings, bins of "
              "5 degC, mean subtracted); most similar pairs first, least similar last.",
              report::columns("gyro: | most like: | rms difference [deg/h] | correlation")};
  std::map<std::string, const TaskResult*> gyros;  // all models of a gyro have the same recordings, and the same curve
  for (const TaskResult& result : lot.results) {
    if (!result.curve.empty()) gyros.emplace(result.gyro, &result);
  }
  const auto closer = [](const Similarity& a, const Similarity& b) {
    return a.difference_deg_per_h < b.difference_deg_per_h;
  };
  std::vector<Similarity> nearest;
  for (const auto& [name, one] : gyros) {
    std::vector<Similarity> pairs;
    for (const auto& [other_name, other] : gyros) {
      if (const auto pair = compare_curves(*one, *other); pair && one != other) pairs.push_back(*pair);
    }
    if (!pairs.empty()) nearest.push_back(*std::min_element(pairs.begin(), pairs.end(), closer));
  }
  std::stable_sort(nearest.begin(), nearest.end(), closer);
  for (const Similarity& pair : nearest)
    table.rows.push_back({gyro_cell(*pair.one, file.reports), gyro_cell(*pair.other, file.reports),
                          general_cell(pair.difference_deg_per_h, 4), report::fixed_cell(pair.correlation, 3)});
  table.meaning = table.rows.empty() ? "No two gyros have enough temperatures in common."
                                     : fmt::format("Gyro {} is least like the others.", table.rows.back().front().text);
  return table;
}

Table drift_table(const LotFile& file, const Lot& lot, const Lot& previous) {
  Table table{"drift", "Drift since the earlier campaign", "Same gyro and model: this campaign minus the earlier one.",
              report::columns("gyro: | model: | mean [deg/h] | against temperature, rms [deg/h] | after, then [deg/h] "
                              "| after, now [deg/h]")};
  double largest = -1;
  table.meaning = "No gyro is in both campaigns.";
  for (const TaskResult& now : lot.results) {
    const auto then = std::find_if(previous.results.begin(), previous.results.end(), [&](const TaskResult& other) {
      return !other.refused && other.gyro == now.gyro && other.model == now.model;
    });
    if (now.refused || then == previous.results.end()) continue;
    std::optional<double> change, of_curve;
    if (now.mean_deg_per_h && then->mean_deg_per_h) change = *now.mean_deg_per_h - *then->mean_deg_per_h;
    if (const auto curves = compare_curves(now, *then)) of_curve = curves->difference_deg_per_h;
    const Cell mean = general_cell(change, 4);
    table.rows.push_back({gyro_cell(now, file.reports), now.model, mean, general_cell(of_curve, 4),
                          general_cell(then->value("bias_stability_deg_per_h"), 4),
                          general_cell(now.value("bias_stability_deg_per_h"), 4)});
    if (std::abs(change.value_or(0)) <= largest) continue;
    largest = std::abs(change.value_or(0));
    table.meaning = fmt::format("The mean changed most for gyro {}, by {} deg/h.", now.gyro, mean.text);
  }
  return table;
}

std::string limits_text(const std::vector<Limit>& limits) {
  std::vector<std::string> texts;
  for (const Limit& limit : limits) texts.push_back(limit.quantity + " " + analysis::range_text(limit));
  return texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, "; "));
}

}  // namespace

std::size_t TaskResult::repeats() const {
  return static_cast<std::size_t>(
      std::count_if(evaluations.begin(), evaluations.end(), [](const auto& e) { return e.role == "repeat"; }));
}

std::optional<double> TaskResult::value(const std::string& quantity) const {
  if (quantity == "mean_of_training_deg_per_h") return mean_deg_per_h;
  double sum = 0, count = 0;
  for (const RecordingResult& recording : evaluations) {
    for (const Measured& m : recording.measured) {
      if (recording.role == "repeat" && m.quantity == quantity && m.value) sum += *m.value, ++count;
    }
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

std::vector<std::string> find_violations(const TaskResult& result, const LotLimits& limits) {
  if (result.refused) return {"refused: " + result.why};
  std::vector<std::string> violations;
  for (const Json& quality : result.data_quality) add_quality_violations(quality, limits, violations);
  for (const RecordingResult& recording : result.evaluations) {
    const std::string where = recording.role + " " + recording.recording;
    add_violations(where, recording.role == "repeat" ? limits.repeat : limits.other, recording.measured, violations);
    if (!recording.trained_on.empty())
      violations.push_back(where + ": not a test: the model was trained on " + recording.trained_on);
  }
  return violations;
}

std::vector<const TaskResult*> Lot::chosen(const std::vector<ModelChoice>& models) const {
  std::map<std::string, std::pair<std::size_t, const TaskResult*>> best;  // by gyro, with the place of its model
  std::vector<std::string> order;
  for (const TaskResult& result : results) {
    const auto place = static_cast<std::size_t>(
        std::find_if(models.begin(), models.end(), [&](const auto& m) { return m.name == result.model; }) -
        models.begin());
    if (!result.accepted() || place == models.size()) continue;
    const auto [found, first] = best.try_emplace(result.gyro, place, &result);
    if (first) order.push_back(result.gyro);
    if (place < found->second.first) found->second = {place, &result};
  }
  std::vector<const TaskResult*> chosen;
  for (const std::string& gyro : order) chosen.push_back(best.at(gyro).second);
  return chosen;
}

Result<Lot> read_lot(const ResultStore& store, const LotLimits& limits) {
  const auto plan = store.read_plan();
  if (!plan) return tl::unexpected<Error>(plan.error());
  Lot lot;
  for (const PlannedTask& task : *plan) {
    if (task.left_out()) {
      lot.left_out.push_back({task.gyro, task.model});
    } else if (!store.has_result(task.id)) {
      lot.missing.push_back({task.gyro, task.model, store.failure(task.id)});
    } else {
      auto result = read_task_result(store, task);
      if (!result) return tl::unexpected<Error>(result.error());
      result->violations = find_violations(*result, limits);
      lot.results.push_back(std::move(*result));
    }
  }
  return lot;
}

report::Report lot_report(const LotFile& file, const Lot& lot, const Lot* previous) {
  report::Report report;
  std::set<std::string> gyros, levels;
  for (const TaskResult& result : lot.results) {
    gyros.insert(result.gyro);
    levels.insert(result.level);
    report.simulated = report.simulated || result.simulated;
  }
  report.title = "Campaign " + file.name;
  report.subtitle =
      fmt::format("{} with a result, {} of them with an accepted model; {} without a result",
                  counted(gyros.size(), "gyro"), lot.chosen(file.models).size(), counted(lot.missing.size(), "task"));
  report.tool = std::string("prismcal ") + kVersion;
  report.facts = {
      {"asked by", file.asked_by.empty() ? "not stated" : file.asked_by},
      {"limits, data quality", fmt::format("worst grade {}; {}", file.limits.warnings_pass ? "warn" : "pass",
                                           limits_text(file.limits.quality))},
      {"limits, repeat", limits_text(file.limits.repeat)},
      {"limits, other profiles", limits_text(file.limits.other)},
      {"processor level", fmt::format("{}", fmt::join(levels, ", "))}};
  for (const LeftOutInput& input : lot.left_out) report.facts.emplace_back("left out", input.what + ": " + input.why);
  if (!lot.missing.empty())
    report.warning = fmt::format("Lot incomplete: {} without a result. ", counted(lot.missing.size(), "task"));
  if (levels.size() > 1)
    report.warning +=
        fmt::format("Processor levels differ: {}; the last digits of models depend on them.", fmt::join(levels, ", "));
  report.sections = {
      {"summary", "The lot", {models_table(file, lot), statistics_table(file, lot)}},
      {"verdicts", "Every gyro", {gyros_table(file, lot)}},
      {"company", "Outliers and similar gyros", {outliers_table(file, lot), nearest_gyros_table(file, lot)}}};
  if (auto figure = statistics_figure(file, lot); !figure.plot.panels.empty())
    report.sections[0].blocks.emplace_back(std::move(figure));
  if (previous) report.sections.push_back({"drift_section", "Drift", {drift_table(file, lot, *previous)}});
  return report;
}

}  // namespace prism::campaign
