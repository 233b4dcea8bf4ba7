// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/lot_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/plain_text.hpp"
#include "config/version.hpp"
#include "tools/prismcal/campaign/lot_analysis.hpp"

namespace prism::campaign {
namespace {

using report::Cell, report::Emphasis, report::Table;

constexpr std::size_t kBars = 24;

Cell gyro_cell(const TaskResult& result, bool pages) {
  Cell cell = report::text_cell(result.gyro);
  if (pages && !result.refused) cell.link = fmt::format("../tasks/{}/report/report.html", result.task);
  return cell;
}

Cell quantity_cell(const TaskResult& result, const char* quantity, int digits) {
  return report::general_cell(lot_value(result, quantity), digits);
}

std::size_t count(const Lot& lot, const std::string& model, const std::function<bool(const TaskResult&)>& which) {
  return static_cast<std::size_t>(std::count_if(lot.results.begin(), lot.results.end(), [&](const TaskResult& result) {
    return result.model == model && which(result);
  }));
}

Table models_table(const CampaignFile& file, const Lot& lot) {
  Table table{"models",
              "The lot by model",
              "Installed: the first accepted model of each gyro, in this order.",
              {{"model", "", false},
               {"options", "", false},
               {"accepted"},
               {"rejected"},
               {"refused"},
               {"without a result"},
               {"installed"}},
              {}};
  const auto chosen = lot.chosen(file.models);
  const auto number = [](std::size_t value) { return report::fixed_cell(static_cast<double>(value), 0); };
  for (const ModelChoice& model : file.models) {
    const auto missing = std::count_if(lot.missing.begin(), lot.missing.end(),
                                       [&](const TaskLine& line) { return line.model == model.name; });
    const auto installed = std::count_if(chosen.begin(), chosen.end(),
                                         [&](const TaskResult* result) { return result->model == model.name; });
    table.rows.push_back(
        {report::text_cell(model.name), report::text_cell(fmt::format("{}", fmt::join(model.words, " "))),
         number(count(lot, model.name, [](const TaskResult& o) { return o.accepted(); })),
         number(count(lot, model.name, [](const TaskResult& o) { return !o.accepted() && !o.refused; })),
         number(count(lot, model.name, [](const TaskResult& o) { return o.refused; })),
         number(static_cast<std::size_t>(missing)), number(static_cast<std::size_t>(installed))});
  }
  std::set<std::string> gyros;
  for (const TaskResult& result : lot.results) gyros.insert(result.gyro);
  table.meaning = fmt::format("{} of {} have an accepted model.", chosen.size(), counted(gyros.size(), "gyro"));
  return table;
}

Table gyros_table(const CampaignFile& file, const Lot& lot) {
  Table table{"gyros",
              "Every gyro with every model",
              "First repeat run; 1 sigma of block means. A value that could not be measured fails its limit.",
              {{"gyro", "", false},
               {"model", "", false},
               {"verdict", "", false},
               {"before", "deg/h"},
               {"after", "deg/h"},
               {"improvement", "%"},
               {"hysteresis", "deg/h"},
               {"within 2 sd", "%"},
               {"by which limit", "", false},
               {"id", "", false}},
              {}};
  for (const TaskResult& result : lot.results) {
    const char* verdict = result.accepted() ? "accepted" : result.refused ? "refused" : "rejected";
    table.rows.push_back(
        {gyro_cell(result, file.reports), report::text_cell(result.model),
         report::text_cell(verdict, result.accepted() ? Emphasis::kGood : Emphasis::kBad),
         quantity_cell(result, "before_deg_per_h", 4), quantity_cell(result, "bias_stability_deg_per_h", 4),
         quantity_cell(result, "improvement_percent", 4), quantity_cell(result, "hysteresis_gap_deg_per_h", 4),
         quantity_cell(result, "within_two_sd_percent", 4),
         report::text_cell(fmt::format("{}", fmt::join(result.violations, "; "))),
         report::text_cell(result.id.substr(0, 12), Emphasis::kMuted)});
  }
  for (const TaskLine& line : lot.missing) {
    std::vector<Cell> row(table.columns.size(), report::text_cell(report::kNothing));
    row[0] = report::text_cell(line.gyro);
    row[1] = report::text_cell(line.model);
    row[2] = report::text_cell("no result", Emphasis::kWarn);
    row[8] = report::text_cell(line.why);
    table.rows.push_back(std::move(row));
  }
  const auto accepted =
      std::count_if(lot.results.begin(), lot.results.end(), [](const TaskResult& o) { return o.accepted(); });
  table.meaning = fmt::format("{} of {} are accepted.", accepted, counted(table.rows.size(), "model"));
  return table;
}

std::vector<double> values_of(const Lot& lot, const std::string& model, const char* quantity) {
  std::vector<double> values;
  for (const TaskResult& result : lot.results) {
    const auto value = result.model == model ? lot_value(result, quantity) : std::nullopt;
    if (value) values.push_back(*value);
  }
  return values;
}

/// The improvements of the first model that has some.
std::string lot_meaning(const CampaignFile& file, const Lot& lot) {
  for (const ModelChoice& model : file.models) {
    const auto values = values_of(lot, model.name, "improvement_percent");
    if (values.empty()) continue;
    const LotStatistics s = statistics_of(values);
    return fmt::format("Model {} improves the median gyro by {:.0f} %, 19 of 20 gyros by {:.0f} % or more.", model.name,
                       s.median, s.low);
  }
  return "No gyro has an improvement.";
}

Table statistics_table(const CampaignFile& file, const Lot& lot) {
  Table table{"spread",
              "Distributions over the lot",
              "Robust sd: 1.4826 × median absolute deviation.",
              {{"model", "", false},
               {"quantity", "", false},
               {"unit", "", false},
               {"gyros"},
               {"least"},
               {"5 %"},
               {"median"},
               {"95 %"},
               {"greatest"},
               {"robust sd"}},
              {}};
  for (const ModelChoice& model : file.models) {
    for (const LotQuantity& quantity : kLotQuantities) {
      const auto values = values_of(lot, model.name, quantity.name);
      if (values.empty()) continue;
      const LotStatistics s = statistics_of(values);
      std::vector<Cell> row = {report::text_cell(model.name), report::text_cell(quantity.name),
                               report::text_cell(quantity.unit), report::fixed_cell(static_cast<double>(s.count), 0)};
      for (const double value : {s.min, s.low, s.median, s.high, s.max, s.robust_sd})
        row.push_back(report::general_cell(value, 4));
      table.rows.push_back(std::move(row));
    }
  }
  table.meaning = lot_meaning(file, lot);
  return table;
}

report::Series histogram(const std::vector<double>& values, double min, double max, std::size_t number) {
  constexpr std::array kInks{report::Ink::kCorrected, report::Ink::kModel, report::Ink::kAccent1, report::Ink::kAccent2,
                             report::Ink::kAccent3};
  report::Series series{"", kInks[number % kInks.size()], report::SeriesStyle::kLinePoints};
  const double width = (max - min) / static_cast<double>(kBars);
  series.y.assign(kBars, 0);
  for (std::size_t i = 0; i < kBars; ++i) series.x.push_back(min + width * (static_cast<double>(i) + 0.5));
  for (const double value : values)
    ++series.y[std::min(kBars - 1, static_cast<std::size_t>(std::max(0.0, (value - min) / width)))];
  return series;
}

/// Histograms from the 1st to the 99th percentile of all models, so that one outlier does not change the bins.
report::Figure statistics_figure(const CampaignFile& file, const Lot& lot) {
  report::Figure figure{"spread_figure",
                        "Distributions over the lot",
                        "Gyros in each of 24 bins; values outside are counted in the first and last bin.",
                        {}};
  figure.plot.columns = 2;
  for (const LotQuantity& quantity : kLotQuantities) {
    std::vector<double> all;
    for (const ModelChoice& model : file.models) {
      for (const double value : values_of(lot, model.name, quantity.name)) all.push_back(value);
    }
    if (all.size() < 2) continue;
    std::sort(all.begin(), all.end());
    const double min = all[all.size() / 100], max = all[all.size() - 1 - all.size() / 100];
    if (!(max > min)) continue;
    report::Panel panel;
    panel.x.label = fmt::format("{}, {}", quantity.name, quantity.unit);
    std::replace(panel.x.label.begin(), panel.x.label.end(), '_', ' ');
    panel.y.label = "gyros";
    for (std::size_t i = 0; i < file.models.size(); ++i) {
      const auto values = values_of(lot, file.models[i].name, quantity.name);
      if (values.empty()) continue;
      panel.series.push_back(histogram(values, min, max, i));
      panel.series.back().name = file.models[i].name;
    }
    figure.plot.panels.push_back(std::move(panel));
  }
  figure.meaning = lot_meaning(file, lot);
  return figure;
}

Table outliers_table(const CampaignFile& file, const Lot& lot) {
  Table table{"outliers",
              "Outliers",
              fmt::format("More than {} robust sd from the median of the lot; for eight or more gyros.", kOutlierScore),
              {{"gyro", "", false},
               {"model", "", false},
               {"quantity", "", false},
               {"value"},
               {"robust sds"},
               {"verdict", "", false}},
              {}};
  for (const Outlier& outlier : find_outliers(lot.results))
    table.rows.push_back({gyro_cell(*outlier.result, file.reports), report::text_cell(outlier.result->model),
                          report::text_cell(outlier.quantity), report::general_cell(outlier.value, 4),
                          report::fixed_cell(outlier.score, 1),
                          report::text_cell(outlier.result->accepted() ? "accepted" : "rejected")});
  table.meaning = table.rows.empty() ? "No gyro differs from the lot."
                                     : fmt::format("Look first at gyro {}.", table.rows.front().front().text);
  return table;
}

Table nearest_gyros_table(const CampaignFile& file, const Lot& lot) {
  Table table{"siblings",
              "Gyros with similar bias curves",
              "Each gyro and the gyro with the most similar bias against temperature (training recordings, bins of "
              "5 degC, mean subtracted); most similar pairs first, least similar last.",
              {{"gyro", "", false}, {"most like", "", false}, {"rms difference", "deg/h"}, {"correlation"}},
              {}};
  for (const NearestGyro& pair : find_nearest_gyros(lot.results))
    table.rows.push_back({gyro_cell(*pair.result, file.reports), gyro_cell(*pair.nearest, file.reports),
                          report::general_cell(pair.similarity.difference_deg_per_h, 4),
                          report::fixed_cell(pair.similarity.correlation, 3)});
  table.meaning = table.rows.empty() ? "No two gyros have enough temperatures in common."
                                     : fmt::format("Gyro {} is least like the others.", table.rows.back().front().text);
  return table;
}

Table drift_table(const CampaignFile& file, const Lot& lot, const Lot& previous) {
  Table table{"drift",
              "Drift since the earlier campaign",
              "Same gyro and model: this campaign minus the earlier one.",
              {{"gyro", "", false},
               {"model", "", false},
               {"mean", "deg/h"},
               {"against temperature, rms", "deg/h"},
               {"after, then", "deg/h"},
               {"after, now", "deg/h"}},
              {}};
  for (const Drift& drift : find_drift(lot.results, previous.results))
    table.rows.push_back({gyro_cell(*drift.now, file.reports), report::text_cell(drift.now->model),
                          report::general_cell(drift.mean_deg_per_h, 4), report::general_cell(drift.curve_deg_per_h, 4),
                          quantity_cell(*drift.before, "bias_stability_deg_per_h", 4),
                          quantity_cell(*drift.now, "bias_stability_deg_per_h", 4)});
  const auto size = [](const std::vector<Cell>& row) { return std::abs(row[2].value.value_or(0)); };
  const auto largest = std::max_element(table.rows.begin(), table.rows.end(),
                                        [&](const auto& a, const auto& b) { return size(a) < size(b); });
  table.meaning = largest == table.rows.end() ? "No gyro is in both campaigns."
                                              : fmt::format("The mean changed most for gyro {}, by {} deg/h.",
                                                            largest->front().text, (*largest)[2].text);
  return table;
}

std::string limits_text(const std::vector<analysis::Limit>& limits) {
  std::string text;
  for (const analysis::Limit& limit : limits) {
    text += text.empty() ? "" : "; ";
    text += limit.quantity;
    if (limit.min) text += fmt::format(" at least {:g}", *limit.min);
    if (limit.max) text += fmt::format(" at most {:g}", *limit.max);
  }
  return text.empty() ? "none" : text;
}

}  // namespace

report::Report lot_report(const CampaignFile& file, const Lot& lot, const Lot* previous) {
  report::Report report;
  std::set<std::string> gyros, levels;
  for (const TaskResult& result : lot.results) {
    gyros.insert(result.gyro);
    levels.insert(result.level);
    report.simulated = report.simulated || result.simulated;
  }
  const std::size_t chosen = lot.chosen(file.models).size();
  report.title = "Campaign " + file.name;
  report.subtitle = fmt::format("{} with a result, {} of them with an accepted model; {} without a result",
                                counted(gyros.size(), "gyro"), chosen, counted(lot.missing.size(), "task"));
  report.tool = std::string("prismcal ") + kVersion;
  report.facts = {
      {"asked by", file.asked_by.empty() ? "not stated" : file.asked_by},
      {"limits, data quality", fmt::format("worst grade {}; {}", file.limits.warnings_pass ? "warn" : "pass",
                                           limits_text(file.limits.findings))},
      {"limits, repeat", limits_text(file.limits.repeat)},
      {"limits, other profiles", limits_text(file.limits.other)},
      {"processor level", fmt::format("{}", fmt::join(levels, ", "))}};
  for (const LeftOutInput& input : lot.left_out) report.facts.emplace_back("left out", input.what + ": " + input.why);
  if (!lot.missing.empty())
    report.warning = fmt::format("Lot incomplete: {} without a result. ", counted(lot.missing.size(), "task"));
  if (levels.size() > 1)
    report.warning +=
        fmt::format("Processor levels differ: {}; the last digits of models depend on them.", fmt::join(levels, ", "));
  report.sections.push_back({"summary", "The lot", {models_table(file, lot), statistics_table(file, lot)}});
  if (auto figure = statistics_figure(file, lot); !figure.plot.panels.empty())
    report.sections[0].blocks.emplace_back(std::move(figure));
  report.sections.push_back({"verdicts", "Every gyro", {gyros_table(file, lot)}});
  report.sections.push_back(
      {"company", "Outliers and similar gyros", {outliers_table(file, lot), nearest_gyros_table(file, lot)}});
  if (previous) report.sections.push_back({"drift_section", "Drift", {drift_table(file, lot, *previous)}});
  return report;
}

}  // namespace prism::campaign
