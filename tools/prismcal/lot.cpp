// SPDX-License-Identifier: MIT
#include "tools/prismcal/lot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <set>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/model_text.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;
using analysis::Limit, analysis::Measured;
using report::Cell, report::columns, report::count_cell, report::Emphasis, report::general_cell, report::Table;

// Limits.

std::optional<double> number_of(const Json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
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
  for (const auto& finding : quality.at("findings")) {
    found.push_back({finding.at("name"), "", number_of(finding.at("value"))});
    if (finding.at("verdict") != "pass") names.push_back(finding.at("name"));
  }
  if (grade == "refuse" || (grade == "warn" && !limits.warnings_pass))
    violations.push_back(fmt::format("data quality: {} ({}), expected {}", grade, fmt::join(names, ", "),
                                     limits.warnings_pass ? "warn" : "pass"));
  std::vector<Limit> applicable = limits.quality;
  const auto is_quantised = [](const auto& named) { return named.quantity == "quantised"; };
  // It is listed only if the rate has steps.
  if (std::none_of(found.begin(), found.end(), is_quantised)) std::erase_if(applicable, is_quantised);
  add_violations("data quality", applicable, found, violations);
}

std::string limits_text(const std::vector<Limit>& limits) {
  std::vector<std::string> texts;
  for (const Limit& limit : limits) texts.push_back(limit.quantity + " " + analysis::range_text(limit));
  return texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, "; "));
}

// Comparison of gyros.

constexpr const char* kMean = "mean_of_training_deg_per_h";
/// The quantities by which gyros are compared, with their units.
constexpr std::array<std::pair<const char*, const char*>, 6> kQuantities{{{"before_deg_per_h", "deg/h"},
                                                                          {"bias_stability_deg_per_h", "deg/h"},
                                                                          {"improvement_percent", "%"},
                                                                          {"hysteresis_gap_deg_per_h", "deg/h"},
                                                                          {"within_two_sd_percent", "%"},
                                                                          {kMean, "deg/h"}}};

/// The mean over the repeat runs, or that of the training.
std::optional<double> value_of(const Task& result, const std::string& quantity) {
  if (result.refused()) return std::nullopt;
  if (quantity == kMean) return number_of(result.json.at("training").at("mean_deg_per_h"));
  double sum = 0, count = 0;
  for (const Json& run : result.json.at("judged")) {
    const auto value = number_of(run.at("measured").value(quantity, Json()));
    if (run.at("role") == "repeat" && value) sum += *value, ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// The values of a quantity of all gyros with one model, in increasing order.
std::vector<double> spread_of(const Lot& lot, const std::string& model, const char* quantity) {
  std::vector<double> values;
  for (const Task& result : lot.results) {
    const auto value = result.model() == model ? value_of(result, quantity) : std::nullopt;
    if (value) values.push_back(*value);
  }
  std::sort(values.begin(), values.end());
  return values;
}

/// Of values in increasing order, with linear interpolation.
double quantile(const std::vector<double>& values, double share) {
  const double position = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const double part = position - static_cast<double>(below);
  return below + 1 < values.size() ? values[below] + part * (values[below + 1] - values[below]) : values.back();
}

/// Bins of temperature, and the mean bias there minus that of all blocks.
using Curve = std::vector<std::pair<double, double>>;

Curve curve_of(const Task& result) {
  return result.refused() ? Curve() : result.json.at("training").at("curve_degc_deg_per_h").get<Curve>();
}

/// Rms difference and correlation of two curves, deg/h; nullopt if they have fewer than four common bins.
std::optional<std::pair<double, double>> compare_curves(const Curve& a, const Curve& b) {
  constexpr std::size_t kMinBins = 4;
  std::vector<double> x, y, difference;
  for (const auto& [degc, bias] : a) {
    for (const auto& [other_degc, other] : b) {
      if (degc == other_degc) x.push_back(bias), y.push_back(other), difference.push_back(bias - other);
    }
  }
  if (x.size() < kMinBins) return std::nullopt;
  const auto centred = evaluation::summarise(difference, evaluation::Divisor::kN, "difference");
  return std::pair(centred ? centred->sd : kUnknown, evaluation::correlate(x, y, "curves").value_or(0));
}

// Tables.

Cell gyro_cell(const LotFile& file, const Task& result) {
  Cell cell(result.gyro());
  if (file.reports && !result.refused()) cell.link = fmt::format("../tasks/{}/report/report.html", result.id());
  return cell;
}

Table models_table(const LotFile& file, const Lot& lot) {
  Table table{"models", "The lot by model", "Installed: the first accepted model of each gyro, in this order.",
              columns("model: | options: | accepted | rejected | refused | without a result | installed")};
  const auto chosen = lot.chosen(file.models);
  std::set<std::string> gyros;
  for (const ModelChoice& model : file.models) {
    std::size_t accepted = 0, rejected = 0, refused = 0, missing = 0, installed = 0;
    for (const Task& result : lot.results) {
      gyros.insert(result.gyro());
      if (result.model() == model.name) ++(result.accepted() ? accepted : result.refused() ? refused : rejected);
    }
    for (const Task& task : lot.missing) missing += task.model() == model.name;
    for (const auto& [gyro, result] : chosen) installed += result->model() == model.name;
    table.rows.push_back({model.name, fmt::format("{}", fmt::join(model.words, " ")), count_cell(accepted),
                          count_cell(rejected), count_cell(refused), count_cell(missing), count_cell(installed)});
  }
  table.meaning = fmt::format("{} of {} have an accepted model.", chosen.size(), counted(gyros.size(), "gyro"));
  return table;
}

Table gyros_table(const LotFile& file, const Lot& lot) {
  Table table{"gyros", "Every gyro with every model",
              "Means over the repeat runs; 1 sigma of block means. Each run must meet the limits; a value that could "
              "not be measured fails its limit.",
              columns("gyro: | model: | verdict: | repeats | before [deg/h] | after [deg/h] | improvement [%] | "
                      "hysteresis [deg/h] | within 2 sd [%] | by which limit: | id:")};
  std::size_t accepted = 0;
  for (const Task& result : lot.results) {
    accepted += result.accepted();
    const Cell verdict = result.accepted() ? Cell("accepted", Emphasis::kGood)
                                           : Cell(result.refused() ? "refused" : "rejected", Emphasis::kBad);
    std::size_t repeats = 0;
    for (const Json& run : result.json.value("judged", Json::array())) repeats += run.at("role") == "repeat";
    std::vector<Cell>& row = table.rows.emplace_back(
        std::vector<Cell>{gyro_cell(file, result), result.model(), verdict, count_cell(repeats)});
    for (std::size_t i = 0; i < 5; ++i) row.push_back(general_cell(value_of(result, kQuantities[i].first), 4));
    row.emplace_back(fmt::format("{}", fmt::join(result.violations, "; ")));
    row.emplace_back(result.json.value("id", "").substr(0, 12), Emphasis::kMuted);
  }
  for (const Task& task : lot.missing) {
    std::vector<Cell>& row = table.rows.emplace_back(table.columns.size(), report::kNothing);
    row[0] = task.gyro(), row[1] = task.model(), row[2] = {"no result", Emphasis::kWarn};
    row[9] = task.violations.empty() ? "not run yet" : task.violations[0];
  }
  table.meaning = fmt::format("{} of {} are accepted.", accepted, counted(table.rows.size(), "model"));
  return table;
}

/// The improvements of the first model that has some.
std::string lot_meaning(const LotFile& file, const Lot& lot) {
  for (const ModelChoice& model : file.models) {
    const std::vector<double> spread = spread_of(lot, model.name, "improvement_percent");
    if (!spread.empty())
      return fmt::format("Model {} improves the median gyro by {:.0f} %, 19 of 20 gyros by {:.0f} % or more.",
                         model.name, quantile(spread, 0.5), quantile(spread, 0.05));
  }
  return "No gyro has an improvement.";
}

Table spread_table(const LotFile& file, const Lot& lot) {
  Table table{"spread", "Distributions over the lot", "Robust sd: 1.4826 × median absolute deviation.",
              columns("model: | quantity: | unit: | gyros | least | 5 % | median | 95 % | greatest | robust sd")};
  for (const ModelChoice& model : file.models) {
    for (const auto& [quantity, unit] : kQuantities) {
      const std::vector<double> spread = spread_of(lot, model.name, quantity);
      if (spread.empty()) continue;
      std::vector<Cell> row = {model.name, quantity, unit, count_cell(spread.size())};
      for (const double share : {0.0, 0.05, 0.5, 0.95, 1.0}) row.push_back(general_cell(quantile(spread, share), 4));
      row.push_back(general_cell(evaluation::robust_sd(spread), 4));
      table.rows.push_back(std::move(row));
    }
  }
  table.meaning = lot_meaning(file, lot);
  return table;
}

/// Histograms from the 1st to the 99th percentile of all models, so that one outlier does not change the bins.
report::Figure spread_figure(const LotFile& file, const Lot& lot) {
  constexpr std::size_t kBars = 24;
  constexpr std::array kInks{report::Ink::kCorrected, report::Ink::kModel, report::Ink::kAccent1, report::Ink::kAccent2,
                             report::Ink::kAccent3};
  report::Figure figure{"spread_figure",
                        "Distributions over the lot",
                        "Gyros in each of 24 bins; values outside are counted in the first and last bin.",
                        {2, 260, {}},
                        lot_meaning(file, lot)};
  for (const auto& [quantity, unit] : kQuantities) {
    std::vector<std::vector<double>> spreads;
    std::vector<double> all;
    for (const ModelChoice& model : file.models) {
      spreads.push_back(spread_of(lot, model.name, quantity));
      all.insert(all.end(), spreads.back().begin(), spreads.back().end());
    }
    if (all.size() < 2) continue;
    std::sort(all.begin(), all.end());
    const double min = all[all.size() / 100], max = all[all.size() - 1 - all.size() / 100];
    if (!(max > min)) continue;
    report::Panel panel{"", {fmt::format("{}, {}", quantity, unit)}, {"gyros"}};
    std::replace(panel.x.label.begin(), panel.x.label.end(), '_', ' ');
    const double width = (max - min) / static_cast<double>(kBars);
    for (std::size_t m = 0; m < spreads.size(); ++m) {
      if (spreads[m].empty()) continue;
      report::Series bars{file.models[m].name, kInks[m % kInks.size()], report::SeriesStyle::kLinePoints};
      bars.y.assign(kBars, 0);
      for (std::size_t i = 0; i < kBars; ++i) bars.x.push_back(min + width * (static_cast<double>(i) + 0.5));
      for (const double value : spreads[m])
        ++bars.y[std::min(kBars - 1, static_cast<std::size_t>(std::max(0.0, (value - min) / width)))];
      panel.series.push_back(std::move(bars));
    }
    figure.plot.panels.push_back(std::move(panel));
  }
  return figure;
}

Table outliers_table(const LotFile& file, const Lot& lot) {
  constexpr std::size_t kMinValues = 8;
  constexpr double kScore = 3.5;  // robust sd from the median (Iglewicz and Hoaglin 1993)
  Table table{"outliers", "Outliers",
              fmt::format("More than {} robust sd from the median of the lot; for eight or more gyros.", kScore),
              columns("gyro: | model: | quantity: | value | robust sds | verdict:")};
  for (const ModelChoice& model : file.models) {
    for (const auto& [quantity, unit] : kQuantities) {
      const std::vector<double> spread = spread_of(lot, model.name, quantity);
      const double sd = spread.size() < kMinValues ? 0 : evaluation::robust_sd(spread);
      for (const Task& result : lot.results) {
        const auto value = result.model() == model.name ? value_of(result, quantity) : std::nullopt;
        const double score = value && sd > 0 ? (*value - quantile(spread, 0.5)) / sd : 0;
        if (std::abs(score) > kScore)
          table.rows.push_back({gyro_cell(file, result), model.name, quantity, general_cell(value, 4),
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

Table siblings_table(const LotFile& file, const Lot& lot) {
  Table table{"siblings", "Gyros with similar bias curves",
              "Each gyro and the gyro with the most similar bias against temperature (training recordings, bins of "
              "5 degC, mean subtracted); most similar pairs first, least similar last.",
              columns("gyro: | most like: | rms difference [deg/h] | correlation")};
  // All models of a gyro have the same recordings, and the same curve.
  std::map<std::string, std::pair<const Task*, Curve>> gyros;
  for (const Task& result : lot.results) {
    if (Curve curve = curve_of(result); !curve.empty()) gyros.try_emplace(result.gyro(), &result, std::move(curve));
  }
  for (const auto& [name, one] : gyros) {
    std::vector<Cell> nearest;
    for (const auto& [other_name, other] : gyros) {
      const auto pair = name == other_name ? std::nullopt : compare_curves(one.second, other.second);
      if (pair && (nearest.empty() || pair->first < *nearest[2].value))
        nearest = {gyro_cell(file, *one.first), gyro_cell(file, *other.first), general_cell(pair->first, 4),
                   report::fixed_cell(pair->second, 3)};
    }
    if (!nearest.empty()) table.rows.push_back(std::move(nearest));
  }
  std::stable_sort(table.rows.begin(), table.rows.end(),
                   [](const auto& a, const auto& b) { return *a[2].value < *b[2].value; });
  table.meaning = table.rows.empty() ? "No two gyros have enough temperatures in common."
                                     : fmt::format("Gyro {} is least like the others.", table.rows.back().front().text);
  return table;
}

Table drift_table(const LotFile& file, const Lot& lot, const Lot& previous) {
  constexpr const char* kStability = "bias_stability_deg_per_h";
  Table table{"drift", "Drift since the earlier campaign", "Same gyro and model: this campaign minus the earlier one.",
              columns("gyro: | model: | mean [deg/h] | against temperature, rms [deg/h] | after, then [deg/h] | after, "
                      "now [deg/h]")};
  double largest = -1;
  table.meaning = "No gyro is in both campaigns.";
  for (const Task& now : lot.results) {
    const auto then = std::find_if(previous.results.begin(), previous.results.end(), [&](const Task& other) {
      return !other.refused() && other.gyro() == now.gyro() && other.model() == now.model();
    });
    if (now.refused() || then == previous.results.end()) continue;
    std::optional<double> change, of_curve;
    const auto mean = value_of(now, kMean), before = value_of(*then, kMean);
    if (mean && before) change = *mean - *before;
    if (const auto curves = compare_curves(curve_of(now), curve_of(*then))) of_curve = curves->first;
    table.rows.push_back({gyro_cell(file, now), now.model(), general_cell(change, 4), general_cell(of_curve, 4),
                          general_cell(value_of(*then, kStability), 4), general_cell(value_of(now, kStability), 4)});
    if (std::abs(change.value_or(0)) <= largest) continue;
    largest = std::abs(change.value_or(0));
    table.meaning =
        fmt::format("The mean changed most for gyro {}, by {} deg/h.", now.gyro(), table.rows.back()[2].text);
  }
  return table;
}

// Installation.

constexpr const char* kManifest = "manifest.json";
constexpr const char* kFormat = "prism-manifest";

std::string file_name_of(const Task& task) {
  std::string name = task.serial() + (task.axis().empty() ? "" : "-" + task.axis());
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && !std::strchr("-_.", c)) c = '_';
  }
  return (name.starts_with(".") ? "_" : "") + name + ".json";
}

std::string requested_by(const LotFile& file) {
  if (!file.asked_by.empty()) return file.asked_by;
  const passwd* user = ::getpwuid(::getuid());
  return user ? user->pw_name : fmt::format("user {}", ::getuid());
}

/// Reads the model of a result. Errors: it is not the model that was evaluated, or belongs to another gyro.
Result<std::string> model_text_of(const LotFile& file, const Task& result) {
  const std::string path = task_folder(file.folder, result.id()) + "/model.json";
  auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return text;
  const auto model = compensation::parse_model(*text, path);
  if (!model) return tl::unexpected<Error>(model.error());
  const compensation::ModelInfo& info = (*model)->info();
  if (info.id != result.json.at("id"))
    return make_error(path, fmt::format("found id {:.12}, expected {:.12}: not the evaluated model", info.id,
                                        result.json.at("id").get<std::string>()));
  if (info.gyro_serial != result.serial())
    return make_error(path, fmt::format("found the model of gyro \"{}\", expected that of \"{}\"", info.gyro_serial,
                                        result.serial()));
  return text;
}

/// The entries of the manifest in `folder`; none if the folder does not exist or is empty.
Result<Json> old_entries(const std::string& folder) {
  std::error_code error;
  if (!fs::exists(folder, error) || fs::is_empty(folder, error)) return Json::array();
  const std::string path = folder + "/" + kManifest;
  const auto text = read_text_file(path, kMaxModelBytes);
  if (!text)
    return make_error(folder,
                      fmt::format("found files but no {}, expected an empty folder or installed models", kManifest));
  const Json json = Json::parse(*text, nullptr, false);
  if (!json.is_object() || json.value("format", "") != kFormat || !json.contains("models") ||
      !json["models"].is_array())
    return make_error(path, fmt::format("found other contents, expected a {} with \"models\"", kFormat));
  return json["models"];
}

/// Writes the models and the manifest into `made`, a new folder that will replace `folder`.
Result<InstalledModels> fill(const LotFile& file, const Lot& lot, const std::string& made, const std::string& folder,
                             bool keep_others) {
  InstalledModels installed;
  Json manifest = {
      {"format", kFormat}, {"version", 1}, {"made", utc_text(std::time(nullptr))}, {"models", Json::array()}};
  std::error_code error;
  const auto is_there = [&](const std::string& name) { return fs::exists(fs::path(made) / name, error); };
  const auto add = [&](const Result<std::string>& text, Json entry) -> Result<void> {
    if (!text) return tl::unexpected<Error>(text.error());
    const std::string name = entry["file"];
    if (!entry.contains("sha256")) entry["sha256"] = sha256_hex(*text);
    manifest["models"].push_back(std::move(entry));
    return write_text_file((fs::path(made) / name).string(), *text);
  };
  for (const auto& [gyro, result] : lot.chosen(file.models)) {
    const std::string name = file_name_of(*result);
    if (is_there(name) || name == kManifest)
      return make_error(name, fmt::format("found a second gyro with this file name ({}), expected unique names", gyro));
    Json entry = {
        {"file", name}, {"campaign", file.name}, {"asked_by", requested_by(file)}, {"limits", file.limits.stated}};
    entry.update(result->json);
    if (auto done = add(model_text_of(file, *result), std::move(entry)); !done)
      return tl::unexpected<Error>(done.error());
    ++installed.models;
  }
  const auto others = old_entries(folder);
  if (!others) return tl::unexpected<Error>(others.error());
  for (const Json& entry : *others) {
    const std::string name = entry.is_object() ? entry.value("file", "") : "";
    if (!keep_others || name.empty() || name.find('/') != std::string::npos || is_there(name)) continue;
    if (auto done = add(read_text_file((fs::path(folder) / name).string(), kMaxModelBytes), entry); !done)
      return tl::unexpected<Error>(done.error());
    ++installed.kept;
  }
  if (auto done = write_text_file(made + "/" + kManifest, json_text(manifest, 1) + "\n"); !done)
    return tl::unexpected<Error>(done.error());
  return installed;
}

}  // namespace

std::vector<std::string> find_violations(const Task& result, const LotLimits& limits) {
  if (result.refused()) return {"refused: " + result.json.at("why").get<std::string>()};
  std::vector<std::string> violations;
  for (const Json& quality : result.json.at("data_quality")) add_quality_violations(quality, limits, violations);
  for (const Json& run : result.json.at("judged")) {
    const std::string where =
        fmt::format("{} {}", run.at("role").get<std::string>(), run.at("recording").get<std::string>());
    std::vector<Measured> measured;
    for (const auto& [quantity, value] : run.at("measured").items())
      measured.push_back({quantity, "", number_of(value)});
    add_violations(where, run.at("role") == "repeat" ? limits.repeat : limits.other, measured, violations);
    const std::string trained_on = run.at("trained_on");
    if (!trained_on.empty()) violations.push_back(where + ": not a test: " + trained_on);
  }
  return violations;
}

std::map<std::string, const Task*> Lot::chosen(const std::vector<ModelChoice>& models) const {
  std::map<std::string, const Task*> chosen;
  for (const ModelChoice& model : models) {
    for (const Task& result : results) {
      if (result.accepted() && result.model() == model.name) chosen.try_emplace(result.gyro(), &result);
    }
  }
  return chosen;
}

namespace {

/// Throws if a key that the report needs is missing or has another type.
void check_keys(const Task& result) {
  for (const char* key : {"level", "outcome", result.refused() ? "why" : "id"}) result.json.at(key).get<std::string>();
  if (result.refused()) return;
  result.json.at("simulated").get<bool>();
  curve_of(result);
  for (const auto& [quantity, unit] : kQuantities) value_of(result, quantity);
}

}  // namespace

Result<Lot> read_lot(const std::string& folder, const LotLimits& limits) {
  auto plan = read_plan(folder);
  if (!plan) return tl::unexpected<Error>(plan.error());
  Lot lot;
  lot.left_out = std::move(plan->left_out);
  for (const Task& task : plan->tasks) {
    if (!has_result(folder, task.id())) {
      const std::string why = failure(folder, task.id());
      lot.missing.push_back({task.json, why.empty() ? std::vector<std::string>() : std::vector{why}});
      continue;
    }
    const std::string path = task_folder(folder, task.id()) + "/result.json";
    const auto text = read_text_file(path, kMaxModelBytes);
    if (!text) return tl::unexpected<Error>(text.error());
    try {
      Task result{Json::parse(*text)};
      for (const char* key : {"task", "serial", "axis"}) result.json[key] = task.json.at(key);
      result.json["model"] = task.model();  // the stored one may be older, since the id does not contain it
      check_keys(result);
      result.violations = find_violations(result, limits);
      lot.results.push_back(std::move(result));
    } catch (const Json::exception& error) {
      return make_error(path, fmt::format("found {}, expected a result of this version; remove its directory to repeat "
                                          "the task",
                                          error.what()));
    }
  }
  return lot;
}

report::Report lot_report(const LotFile& file, const Lot& lot, const Lot* previous) {
  report::Report report;
  std::set<std::string> gyros, levels;
  for (const Task& result : lot.results) {
    gyros.insert(result.gyro());
    levels.insert(result.json.at("level"));
    report.simulated = report.simulated || result.json.value("simulated", false);
  }
  report.title = "Campaign " + file.name;
  report.subtitle =
      fmt::format("{} with a result, {} of them with an accepted model; {} without a result",
                  counted(gyros.size(), "gyro"), lot.chosen(file.models).size(), counted(lot.missing.size(), "task"));
  report.tool = "prismcal " + file.version;
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
  report.sections = {{"summary", "The lot", {models_table(file, lot), spread_table(file, lot)}},
                     {"verdicts", "Every gyro", {gyros_table(file, lot)}},
                     {"company", "Outliers and similar gyros", {outliers_table(file, lot), siblings_table(file, lot)}}};
  if (auto figure = spread_figure(file, lot); !figure.plot.panels.empty())
    report.sections[0].blocks.emplace_back(std::move(figure));
  if (previous) report.sections.push_back({"drift_section", "Drift", {drift_table(file, lot, *previous)}});
  return report;
}

Result<InstalledModels> install_models(const LotFile& file, const Lot& lot, const std::string& folder,
                                       bool keep_others) {
  std::error_code error;
  std::string target = fs::absolute(folder, error).lexically_normal().string();
  while (target.size() > 1 && target.back() == '/') target.pop_back();
  if (fs::is_symlink(target, error)) target = fs::canonical(target, error).string();
  const std::string made = fmt::format("{}.{}.new", target, ::getpid());
  fs::remove_all(made, error);
  if (!fs::create_directories(made, error)) return make_error(made, error ? error.message() : "cannot be created");
  auto installed = fill(file, lot, made, target, keep_others);
  const bool exists = fs::exists(target, error);
  if (installed && (exists ? ::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE)
                           : ::rename(made.c_str(), target.c_str())) != 0)
    installed = make_error(target, fmt::format("cannot be exchanged atomically: {}; unchanged", std::strerror(errno)));
  if (!installed || exists) fs::remove_all(made, error);
  return installed;
}

}  // namespace prism::campaign
