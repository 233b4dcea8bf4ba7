// SPDX-License-Identifier: MIT
#include "tools/prismcal/training_set.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>
#include <vector>

#include "base/plain_text.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "tools/prismcal/block_table.hpp"

namespace prism::recordings {
namespace {

/// Compares `key` of a recording with the previous ones. Errors: they differ; a model is for one axis of one gyro.
/// `none`: value that version 0.1 wrote for unknown.
Result<void> check_source(const Recording& recording, const char* key, const char* called, const char* none,
                          std::string& known) {
  const std::string found = recording.value(key);
  if (found.empty() || found == none) return {};
  if (!known.empty() && known != found) {
    return make_error(recording.name, fmt::format("found {} \"{}\", expected \"{}\" as in the previous recordings",
                                                  called, found, known));
  }
  known = found;
  return {};
}

tl::unexpected<Error> no_input(const std::string& name) {
  return make_error(
      "--inputs",
      fmt::format("found \"{}\", expected T, dTdt, U, or for a sensor NAME, dNAME/dt or NAME-T (same unit); "
                  "a gyro that follows its thermometer slowly has --response",
                  name));
}

/// Checks that a recording has all sensors of the inputs, with the units of the first recording.
Result<void> check_inputs(const Recording& recording, TrainingSet& set) {
  const std::vector<SensorName> available = recording.sensors();
  const bool first = set.recordings.empty();
  for (const std::string& name : compensation::sensors_of(set.data.names)) {
    const std::size_t index = sensor_index(available, name);
    if (index == available.size())
      return name.starts_with("lag") ? no_input(name)
                                     : make_error(recording.name, fmt::format("found no sensor \"{}\" of --inputs; its "
                                                                              "sensors: {}",
                                                                              name, sensors_text(available)));
    if (first) set.features.sensors.push_back(available[index]);
    const std::string& unit = set.features.sensors[sensor_index(set.features.sensors, name)].unit;
    if (unit != available[index].unit)
      return make_error(recording.name, fmt::format("found \"{}\" in {}, expected {} as in the first recording", name,
                                                    available[index].unit, unit));
  }
  for (const std::string& name : set.data.names) {
    if (!compensation::has_input(set.features, name)) return no_input(name);
  }
  return {};
}

/// Checks a recording against the set.
Result<void> check_recording(const Recording& recording, TrainingSet& set) {
  if (auto same = check_source(recording, "gyro_serial", "gyro", "unknown", set.serial); !same) return same;
  if (auto same = check_source(recording, "axis", "axis", "-", set.axis); !same) return same;
  return check_inputs(recording, set);
}

/// Why no block has all inputs.
tl::unexpected<Error> missing_input(const TrainingSet& set) {
  std::vector<std::string> known, missing;
  for (const std::string& name : set.data.names) {
    const bool found = std::ranges::any_of(set.recordings, [&](const Loaded& loaded) {
      const std::vector<double> column = loaded.table.column(name);
      return std::ranges::any_of(column, [](double value) { return std::isfinite(value); });
    });
    (found ? known : missing).push_back(name);
  }
  if (!missing.empty())
    return make_error(
        "input " + missing.front(),
        fmt::format("{}{}{}",
                    missing.front() == compensation::kInputUhfo ? "the recording contains no oscillator voltage"
                                                                : "it is unknown in all blocks",
                    known.empty() ? "" : "; use --inputs ", fmt::join(known, ",")));
  return make_error("recordings", "found no block in which every input is known");
}

}  // namespace

nlohmann::ordered_json facts_of(const Recording& recording, const BlockTable& table, std::size_t left_out) {
  nlohmann::ordered_json facts = {{"name", recording.name}, {"files", nlohmann::ordered_json::array()}};
  for (const SourceFile& file : recording.files)
    facts["files"].push_back({{"path", file.path}, {"sha256", file.sha256}, {"rows", file.rows}});
  facts.update({{"blocks", table.size()},
                {"blocks_left_out", left_out},
                {"gaps", table.gaps},
                {"missing_s", table.missing_s},
                {"earth_rate_deg_per_h", table.earth_rate_deg_per_h},
                {"fingerprint", fingerprint_json(table)}});
  if (auto remarks = recording.remarks(); !remarks.empty()) facts["remarks"] = std::move(remarks);
  if (auto questions = recording.questions(); !questions.empty()) facts["questions"] = std::move(questions);
  return facts;
}

std::size_t append_blocks(const BlockTable& table, training::TrainingData& data) {
  const auto n = static_cast<Eigen::Index>(table.size()), d = static_cast<Eigen::Index>(data.names.size());
  const auto vector = [&](const std::vector<double>& of_blocks) {
    return Eigen::VectorXd(Eigen::VectorXd::Map(of_blocks.data(), n));
  };
  Eigen::MatrixXd inputs(d, n);
  for (Eigen::Index i = 0; i < d; ++i) inputs.row(i) = vector(table.column(data.names[static_cast<std::size_t>(i)]));
  training::Rows known;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (inputs.col(i).allFinite()) known.push_back(i);
  }
  const auto added = static_cast<Eigen::Index>(known.size()), all = data.target.size() + added;
  data.inputs.conservativeResize(d, all);
  data.target.conservativeResize(all);
  data.time_s.conservativeResize(all);
  data.inputs.rightCols(added) = inputs(Eigen::all, known);
  data.target.tail(added) = vector(table.bias_deg_per_h)(known);
  data.time_s.tail(added) = 3600 * vector(table.hours())(known);
  data.runs.resize(static_cast<std::size_t>(all), data.runs.empty() ? 0 : data.runs.back() + 1);
  return table.size() - known.size();
}

Result<Unusable> use_each(const std::vector<std::string>& paths, bool strict,
                          const std::function<Result<void>(const std::string& path)>& use) {
  Unusable left_out;
  for (const std::string& path : paths) {
    auto done = use(path);
    if (!done && (strict || paths.size() == 1)) return tl::unexpected<Error>(done.error());
    if (!done) left_out.emplace_back(path, done.error().text());
  }
  if (left_out.size() < paths.size()) return left_out;
  return make_error("recordings", fmt::format("none of {} can be used (inspect FILE… has all reasons): {}",
                                              left_out.size(), left_out.front().second));
}

compensation::FeatureDefinition TrainingSetOptions::window() const {
  compensation::FeatureDefinition chosen = features;
  chosen.slope =
      slope == "difference" ? compensation::SlopeMethod::kDifference : compensation::SlopeMethod::kLeastSquares;
  chosen.end_mean_s = std::min(chosen.end_mean_s, chosen.length_s);
  return chosen;
}

Result<TrainingSet> read_training_set(const std::vector<std::string>& paths, const std::vector<std::string>& inputs,
                                      const TrainingSetOptions& options, const Judge& judge) {
  TrainingSet set;
  set.features = options.window();
  set.data.names = inputs;
  set.facts = nlohmann::ordered_json::array();
  for (const std::string& name : inputs) {
    if (!compensation::has_input(set.features, name) && compensation::sensors_of({name}).empty()) return no_input(name);
  }
  UnmatchedRanges unmatched(options.source.leave_out);
  std::vector<double> second_sds;
  const auto use = [&](const std::string& path) -> Result<void> {
    const auto refuse = [&, before = std::tuple(set.serial, set.axis, set.features.sensors)](const Error& error) {
      std::tie(set.serial, set.axis, set.features.sensors) = before;
      return tl::unexpected<Error>(error);
    };
    auto loaded = read_blocks(path, options.source, options.site, set.features,
                              [&](const Recording& recording) { return check_recording(recording, set); });
    if (!loaded) return refuse(loaded.error());
    auto quality = judge ? judge(*loaded) : evaluation::DataQuality{};
    if (!quality) return refuse(quality.error());
    auto& [recording, table] = *loaded;
    const std::size_t left_out = append_blocks(table, set.data);
    unmatched.add(recording);
    const bool announced = options.source.table.announce && !options.source.map.empty();  // by read_mapped()
    std::vector<Finding> to_note;
    if (!announced) to_note = recording.findings;
    const double mean_deg_per_h = table.mean_rate_deg_per_h();
    if (auto question = sign_question(mean_deg_per_h, table.earth_rate_deg_per_h)) {
      recording.findings.push_back(*question);
      to_note.push_back(std::move(*question));
    }
    set.facts.push_back(facts_of(recording, table, left_out));
    for (const double sd : table.second_sds()) {
      if (std::isfinite(sd)) second_sds.push_back(sd);
    }
    table.seconds = {};  // not needed for training
    set.notes.push_back(
        fmt::format("{}: {} of {} s; {}, {} s in all; {} more left out (unknown input); mean bias {:.4g} deg/h, "
                    "without the Earth rate on the axis, {:.4g} deg/h",
                    recording.name, counted(table.size() - left_out, "block"), set.features.length_s,
                    counted(table.gaps, "gap"), table.missing_s, counted(left_out, "block"),
                    mean_deg_per_h - table.earth_rate_deg_per_h, table.earth_rate_deg_per_h));
    for (const Severity severity : {Severity::kRemark, Severity::kQuestion}) {
      for (const std::string& line : lines_of(to_note, severity)) set.notes.push_back(recording.name + ": " + line);
    }
    const std::vector<std::string> questions = recording.questions();
    set.questions.insert(set.questions.end(), questions.begin(), questions.end());
    set.recordings.push_back(std::move(*loaded));
    set.qualities.push_back(std::move(*quality));
    return {};
  };
  auto left_out = use_each(paths, options.strict, use);
  if (!left_out) return tl::unexpected<Error>(left_out.error());
  set.left_out = std::move(*left_out);
  if (auto good = unmatched.finish(); !good) return tl::unexpected<Error>(good.error());
  if (set.data.target.size() == 0) return missing_input(set);
  if (!second_sds.empty()) set.second_sd_deg_per_h = evaluation::median_of(std::move(second_sds));
  return set;
}

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

Result<std::vector<std::string>> candidate_inputs(const std::string& path, const TrainingSetOptions& options) {
  constexpr double kSame_degc = 0.02;  // of the thermometer of T itself: their difference would only be rounding
  compensation::FeatureDefinition features = options.window();
  const auto loaded =
      read_blocks(path, options.source, options.site, features, [&](const Recording& recording) -> Result<void> {
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
    if (!often(known) || (sensor.unit == "degC" && std::ranges::none_of(known, differs))) continue;
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
    const auto best = std::ranges::min_element(sets, better);
    const auto which = left.begin() + (best - sets.begin());
    chosen.back() = *which;
    left.erase(which);
    search.path.push_back(std::move(*best));
  }
  const auto best = std::ranges::min_element(search.path, better);
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

}  // namespace prism::recordings
