// SPDX-License-Identifier: MIT
#include "tools/prismcal/lot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <glob.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <map>
#include <set>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/plain_text.hpp"
#include "base/sha256.hpp"
#include "base/text_number.hpp"
#include "compensation/evaluation/statistics.hpp"
#include "compensation/model_text.hpp"
#include "tools/prismcal/log_folder.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

std::string absolute_in(const fs::path& base, const std::string& path) {
  return (base / path).lexically_normal().string();
}

/// One option with its value, as on a command line; empty for a flag that is false.
std::string word_of(const std::string& key, const Json& value, const Section& section) {
  if (value.is_boolean()) return value.get<bool>() ? "--" + key : "";
  const auto text = [](const Json& item) { return item.is_string() ? item.get<std::string>() : json_text(item); };
  const auto good = [](const Json& item) { return item.is_string() || item.is_number(); };
  if (good(value)) return fmt::format("--{}={}", key, text(value));
  if (!value.is_array() || value.empty() || !std::all_of(value.begin(), value.end(), good)) {
    section.fail(key, fmt::format("found {}, expected a text, a number, true, or an array of them", shown(value)));
    return {};
  }
  std::string list;
  for (const Json& item : value) list += (list.empty() ? "" : ",") + text(item);
  return fmt::format("--{}={}", key, list);
}

std::vector<std::string> words_of(const Section& section, std::vector<std::string> words = {}) {
  for (const std::string& key : section.names(TextRule::kName)) {
    if (key == "prior" || key == "config" || key == "fallback")
      section.fail(key, "found it, expected no option of a file that is not an input of a task");
    if (key == "serial") section.fail(key, "found it, expected none: a model is bound to its recordings");
    std::string word = word_of(key, section.any(key), section);
    if (!word.empty()) words.push_back(std::move(word));
  }
  return words;
}

std::vector<RecordingPattern> read_patterns(const Section& root, const fs::path& base) {
  std::vector<RecordingPattern> recordings;
  for (const Section& section : root.objects("recordings")) {
    constexpr std::array kRoles{kTrain, kRepeat, kOther};
    const std::string role = kRoles[section.choice("role", kRoles)], serial = section.text("serial", "");
    for (const std::string& path : section.texts("paths")) {
      const std::string all = absolute_in(base, path);
      if (serial == "*" && (std::ranges::count(all, '*') != 1 || all.find_first_of("?[{") != all.npos))
        section.fail("serial", fmt::format("found \"*\" with the path {}, expected a path with one * and no other "
                                           "wildcard",
                                           path));
      recordings.push_back({role, all, serial});
    }
  }
  for (const char* const role : {kTrain, kRepeat}) {
    if (root.good() && std::ranges::count(recordings, role, &RecordingPattern::role) == 0)
      root.fail("recordings", fmt::format("found no recording with role {}, expected one or more", role));
  }
  return recordings;
}

std::vector<analysis::Limit> read_limits(const Section& limits, const char* key) {
  return limits.has(key) ? analysis::limits_in(limits.object(key)) : std::vector<analysis::Limit>();
}

}  // namespace

Result<LotFile> parse_lot_file(std::string_view text, const std::string& path) {
  const auto document = parse_json_object(text, path);
  if (!document) return tl::unexpected<Error>(document.error());
  std::error_code error;
  LotFile file;
  file.path = fs::absolute(path, error).lexically_normal().string();
  const fs::path base = fs::path(file.path).parent_path();
  const Section root(*document);
  file.warnings = root.removed(KeyFile::kCampaign);
  root.has("$schema");  // for editors
  file.name = root.text("name", fs::path(file.path).stem().string(), TextRule::kName);
  file.asked_by = root.text("asked_by", "");
  file.recordings = read_patterns(root, base);
  const std::vector<std::string> reading = words_of(root.object("reading"));
  const Section models = root.object("models", true);
  for (const std::string& name : models.names(TextRule::kName))
    file.models.push_back({name, words_of(models.object(name), reading)});
  if (root.good() && file.models.empty()) root.fail("models", "found none, expected one or more");
  file.judging = words_of(root.object("judging"), reading);
  const Section limits = root.object("limits");
  file.limits.warnings_pass = limits.object("data_quality").choice("verdict", {"pass", "warn"}, 1) == 1;
  file.limits.repeat = read_limits(limits, "repeat");
  file.limits.other = read_limits(limits, "other");
  if (root.has("limits")) file.limits.stated = root.any("limits");
  const Section output = root.object("output");
  file.folder = absolute_in(base, output.text("folder", file.name + ".campaign"));
  file.reports = output.boolean("reports", true);
  if (auto done = root.finish(); !done) return tl::unexpected<Error>(done.error());
  return file;
}

// Tasks.

namespace {

std::string last_name(const std::string& path) {
  const fs::path name(path);
  return (name.has_filename() ? name : name.parent_path()).filename().string();
}

std::string id_of(Json task) {
  constexpr std::size_t kIdChars = 32;
  task["task"] = task["model"] = "";
  for (Json& input : task["inputs"]) {
    input["path"] = last_name(input["path"]);
    for (Json& file : input["files"]) file["path"] = last_name(file["path"]);
  }
  return sha256_hex(json_text(task)).substr(0, kIdChars);
}

/// The file itself, or the logs of a folder, sorted by name. Errors: a file cannot be read.
Result<Json> files_of_recording(const std::string& path) {
  std::error_code error;
  Json files = Json::array();
  const bool is_folder = fs::is_directory(path, error);
  for (const std::string& name : is_folder ? recordings::files_of(path, ".csv") : std::vector<std::string>{path}) {
    const auto sha256 = sha256_of_file(name);
    if (!sha256) return tl::unexpected<Error>(sha256.error());
    files.push_back({{"path", name}, {"sha256", *sha256}});
  }
  return files;
}

using Owner = std::pair<std::string, std::string>;  // serial number and axis

/// Errors: the files are of several gyros or axes, or have no serial number.
Result<Owner> owner_of(const std::string& path, const RecordingPattern& recording) {
  const auto& [role, pattern, serial] = recording;
  if (serial == "*") return Owner(path.substr(pattern.find('*'), path.size() + 1 - pattern.size()), "");
  if (!serial.empty()) return Owner(serial, "");
  const auto log = recordings::LogFolder::open(path);
  if (!log) return tl::unexpected<Error>(log.error());
  const auto known = [&](const char* key) {
    const std::string value = log->segments.front().value(key);
    return value == "-" || value == "unknown" ? std::string() : value;
  };
  if (known("gyro_serial").empty())
    return make_error(path,
                      "found no gyro_serial in its log, expected one, or serial in the lot's file: a model is "
                      "bound to it");
  return Owner(known("gyro_serial"), known("axis"));
}

/// Adds the recordings of a pattern to the inputs of their gyros. Errors: it matches no file.
Result<void> add_recordings(const RecordingPattern& recording, std::map<Owner, Json>& gyros, Lot& plan) {
  glob_t found{};
  const bool any = ::glob(recording.pattern.c_str(), GLOB_BRACE, nullptr, &found) == 0;
  const std::vector<std::string> paths(found.gl_pathv, found.gl_pathv + (any ? found.gl_pathc : 0));
  ::globfree(&found);
  if (!any) return make_error(recording.pattern, "matches no file, expected one or more recordings");
  for (const std::string& path : paths) {
    if (const auto owner = owner_of(path, recording))
      gyros[*owner].push_back({{"role", recording.role}, {"path", path}});
    else
      plan.left_out.emplace_back(path, owner.error().what);
  }
  return {};
}

/// Renames the result into place, and removes what killed processes left of this task. Keeps a result that another
/// process has finished meanwhile.
Result<void> publish(const std::string& unfinished, const LotFile& file, const Task& task) {
  sync_directory(unfinished);
  const std::string target = task_folder(file, task);
  if (::rename(unfinished.c_str(), target.c_str()) != 0 && errno != ENOTEMPTY && errno != EEXIST)
    return make_error(target, std::strerror(errno));
  std::error_code error;
  std::vector<fs::path> left;
  for (fs::directory_iterator at(file.folder + "/tasks", error), end; !error && at != end; at.increment(error)) {
    if (at->path().filename().string().starts_with("." + task.id() + ".")) left.push_back(at->path());
  }
  for (const fs::path& path : left) fs::remove_all(path, error);
  sync_directory(file.folder + "/tasks");
  return {};
}

}  // namespace

const char* Task::state() const {
  return !done() ? "to do" : !trained() ? "refused" : violations.empty() ? "accepted" : "rejected";
}

std::vector<std::string> Task::paths(std::string_view role) const {
  std::vector<std::string> found;
  for (const Json& input : json.at("inputs")) {
    if (input.at("role") == role) found.push_back(input.at("path"));
  }
  return found;
}

Result<Lot> make_plan(const LotFile& file, const std::string& only) {
  Lot plan;
  std::map<Owner, Json> gyros;
  for (const RecordingPattern& recording : file.recordings) {
    if (auto done = add_recordings(recording, gyros, plan); !done) return tl::unexpected<Error>(done.error());
  }
  for (const auto& [owner, inputs] : gyros) {
    Task task{{{"task", ""},
               {"serial", owner.first},
               {"axis", owner.second},
               {"model", ""},
               {"train", Json::array()},
               {"judging", file.judging},
               {"version", file.version},
               {"report", file.reports},
               {"inputs", inputs}}};
    const bool trains = !task.paths(kTrain).empty();
    if (!trains || task.paths(kRepeat).empty()) {
      plan.left_out.emplace_back(
          task.gyro(), fmt::format("found no recording with role {}, expected one or more", trains ? kRepeat : kTrain));
      continue;
    }
    std::vector<Task> tasks;
    for (const ModelChoice& model : file.models) {
      task.json["train"] = model.words;
      task.json["model"] = model.name;
      if (only.empty() || task.name() == only) tasks.push_back(task);
    }
    if (tasks.empty()) continue;
    Json read = inputs;
    for (Json& input : read) {
      auto files = files_of_recording(input["path"]);
      if (!files) return tl::unexpected<Error>(files.error());
      input["files"] = std::move(*files);
    }
    for (Task& one : tasks) {
      one.json["inputs"] = read;
      one.json["task"] = id_of(one.json);
      plan.tasks.push_back(std::move(one));
    }
  }
  if (!plan.tasks.empty()) return plan;
  if (!only.empty())
    return make_error(only, fmt::format("not a task of {}; --plan names them, and what is left out", file.path));
  return make_error(file.path,
                    plan.left_out.empty()
                        ? std::string("found no gyro, expected one or more")
                        : fmt::format("found no gyro with train and repeat recordings; first of {} left out: {}: {}",
                                      plan.left_out.size(), plan.left_out[0].first, plan.left_out[0].second));
}

std::string task_folder(const LotFile& file, const Task& task) { return file.folder + "/tasks/" + task.id(); }

bool has_result(const LotFile& file, const Task& task) { return ::access(task_folder(file, task).c_str(), F_OK) == 0; }

Result<void> run_task(const LotFile& file, const Task& task, const Work& work) {
  if (has_result(file, task)) return {};
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  const std::string unfinished = fmt::format("{}/tasks/.{}.{}.{}", file.folder, task.id(), host, ::getpid());
  std::error_code error;
  fs::remove_all(unfinished, error);
  if (!fs::create_directories(unfinished, error)) return make_error(unfinished, error.message());
  auto done = work(task, unfinished).and_then([&](const Json& outcome) {
    Json json = task.json;
    json.update(outcome);
    return write_text_file(unfinished + "/result.json", json_text(json, 1) + "\n").and_then([&] {
      return publish(unfinished, file, task);
    });
  });
  if (done || has_result(file, task)) return {};  // or another process has finished it meanwhile
  fs::remove_all(unfinished, error);
  return done;
}

// Results.

namespace {

using analysis::Limit, analysis::Measured;
using report::Cell, report::columns, report::count_cell, report::Emphasis, report::general_cell, report::Table;

std::optional<double> number_of(const Json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

void add_violations(const std::string& where, const std::vector<Limit>& limits, const Json& values,
                    std::vector<std::string>& violations) {
  std::vector<Measured> measured;
  for (const auto& [quantity, value] : values.items()) measured.push_back({quantity, "", number_of(value)});
  for (const analysis::LimitCheck& check : analysis::check_limits(limits, measured)) {
    const auto& value = check.measured.value;
    if (!check.pass)
      violations.push_back(fmt::format("{}: {} {}, expected {}", where, check.limit.quantity,
                                       value ? fmt::format("{:.4g}", *value) : "not measured",
                                       analysis::range_text(check.limit)));
  }
}

std::string limits_text(const std::vector<Limit>& limits) {
  std::vector<std::string> texts;
  for (const Limit& limit : limits) texts.push_back(limit.quantity + " " + analysis::range_text(limit));
  return texts.empty() ? "none" : fmt::format("{}", fmt::join(texts, "; "));
}

// Comparison of gyros.

constexpr const char* kMean = "mean_of_training_deg_per_h";
constexpr std::string_view kImprovement = "improvement_percent";
/// The quantities by which gyros are compared, with their units.
constexpr std::array<std::pair<const char*, const char*>, 6> kQuantities{{{"before_deg_per_h", "deg/h"},
                                                                          {"bias_stability_deg_per_h", "deg/h"},
                                                                          {kImprovement.data(), "%"},
                                                                          {"hysteresis_gap_deg_per_h", "deg/h"},
                                                                          {"within_two_sd_percent", "%"},
                                                                          {kMean, "deg/h"}}};

/// The mean over the repeat runs, or that of the training.
std::optional<double> value_of(const Task& result, const std::string& quantity) {
  if (!result.trained()) return std::nullopt;
  if (quantity == kMean) return number_of(result.json.at("training").at("mean_deg_per_h"));
  double sum = 0, count = 0;
  for (const Json& run : result.json.at("judged")) {
    const auto value = number_of(run.at("measured").value(quantity, Json()));
    if (run.at("role") == kRepeat && value) sum += *value, ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// Of values in increasing order, with linear interpolation.
double quantile(const std::vector<double>& values, double share) {
  const double position = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const double part = position - static_cast<double>(below);
  return below + 1 < values.size() ? values[below] + part * (values[below + 1] - values[below]) : values.back();
}

// Tables.

Table models_table(const LotFile& file, const Lot& lot) {
  Table table{"models", "The lot by model", "Installed: the first accepted model of each gyro, in this order.",
              columns("model: | options: | accepted | rejected | refused | without a result | installed")};
  const auto installed = chosen(lot, file.models);
  for (const ModelChoice& model : file.models) {
    std::map<std::string, std::size_t> counts;
    for (const Task& task : lot.tasks) counts[task.model() == model.name ? task.state() : "of another model"]++;
    for (const auto& [gyro, result] : installed) counts["installed"] += result->model() == model.name;
    std::vector<Cell>& row = table.rows.emplace_back();
    row = {model.name, fmt::format("{}", fmt::join(model.words, " "))};
    for (const char* state : {"accepted", "rejected", "refused", "to do", "installed"})
      row.push_back(count_cell(counts[state]));
  }
  table.meaning = fmt::format("Gyros with an accepted model: {}.", installed.size());
  return table;
}

Table gyros_table(const LotFile& file, const Lot& lot) {
  Table table{"gyros", "Every gyro with every model",
              "Means over the repeat runs; 1 sigma of block means. Each run must meet the limits; a value that could "
              "not be measured fails its limit.",
              columns("gyro: | model: | verdict: | repeats | before [deg/h] | after [deg/h] | improvement [%] | "
                      "hysteresis [deg/h] | within 2 sd [%] | mean of training [deg/h] | by which limit: | id:")};
  std::size_t accepted = 0;
  for (const Task& task : lot.tasks) {
    const std::string state = task.state();
    accepted += state == "accepted";
    const Emphasis emphasis = state == "accepted" ? Emphasis::kGood : task.done() ? Emphasis::kBad : Emphasis::kWarn;
    std::vector<Cell>& row = table.rows.emplace_back();
    row = {task.gyro(), task.model(), {state, emphasis}};
    if (file.reports && task.trained()) row[0].link = fmt::format("../tasks/{}/report/report.html", task.id());
    std::size_t repeats = 0;
    for (const Json& run : task.json.value("judged", Json::array())) repeats += run.at("role") == kRepeat;
    row.push_back(task.done() ? count_cell(repeats) : Cell(report::kNothing));
    for (const auto& [quantity, unit] : kQuantities) row.push_back(general_cell(value_of(task, quantity), 4));
    row.emplace_back(fmt::format("{}", fmt::join(task.violations, "; ")));
    row.emplace_back(task.json.value("id", report::kNothing).substr(0, 12), Emphasis::kMuted);
  }
  table.meaning = fmt::format("{} of {} are accepted.", accepted, counted(table.rows.size(), "model"));
  return table;
}

Table spread_table(const LotFile& file, const Lot& lot) {
  constexpr std::size_t kMinValues = 8;
  constexpr double kScore = 3.5;  // Iglewicz and Hoaglin 1993
  Table table{"spread", "Distributions over the lot",
              "Robust sd: 1.4826 × median absolute deviation. Outliers: more than 3.5 robust sd from the median; for "
              "eight or more gyros.",
              columns("model: | quantity: | unit: | gyros | least | 5 % | median | 95 % | greatest | robust sd | "
                      "outliers:")};
  for (const ModelChoice& model : file.models) {
    for (const auto& [quantity, unit] : kQuantities) {
      std::vector<std::pair<double, std::string>> known;
      for (const Task& task : lot.tasks) {
        if (task.model() != model.name) continue;
        if (const auto value = value_of(task, quantity)) known.emplace_back(*value, task.gyro());
      }
      if (known.empty()) continue;
      std::vector<double> values;
      for (const auto& [value, gyro] : known) values.push_back(value);
      std::ranges::sort(values);
      const double median = quantile(values, 0.5), sd = evaluation::robust_sd(values);
      std::vector<std::string> outliers;
      for (const auto& [value, gyro] : known) {
        if (known.size() >= kMinValues && sd > 0 && std::abs(value - median) > kScore * sd) outliers.push_back(gyro);
      }
      std::vector<Cell>& row = table.rows.emplace_back();
      row = {model.name, quantity, unit, count_cell(values.size())};
      for (const double share : {0.0, 0.05, 0.5, 0.95, 1.0}) row.push_back(general_cell(quantile(values, share), 4));
      row.push_back(general_cell(sd, 4));
      row.emplace_back(fmt::format("{}", fmt::join(outliers, ", ")));
      if (table.meaning.empty() && quantity == kImprovement)
        table.meaning =
            fmt::format("Model {} improves the median gyro by {:.0f} %, 19 of 20 gyros by {:.0f} % or more.",
                        model.name, median, quantile(values, 0.05));
    }
  }
  if (table.meaning.empty()) table.meaning = "No gyro has an improvement.";
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
  return fmt::format("{}{}.json", name.starts_with(".") ? "_" : "", name);
}

/// Reads the model of a result. Errors: it is not the model that was evaluated, or belongs to another gyro.
Result<std::string> model_text_of(const LotFile& file, const Task& result) {
  const std::string path = task_folder(file, result) + "/model.json";
  auto text = read_text_file(path, kMaxModelBytes);
  if (!text) return text;
  const auto model = compensation::parse_model(*text, path);
  if (!model) return tl::unexpected<Error>(model.error());
  const compensation::ModelInfo& info = (*model)->info();
  if (result.json.at("id") != info.id)
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
  const auto text = read_text_file(folder + "/" + kManifest, kMaxModelBytes);
  const Json json = text ? Json::parse(*text, nullptr, false) : Json();
  if (json.is_object() && json.value("format", Json()) == kFormat && json.contains("models") &&
      json["models"].is_array())
    return json["models"];
  return make_error(folder, fmt::format("found no {} of installed models, expected an empty folder or one", kManifest));
}

}  // namespace

std::vector<std::string> find_violations(const Task& result, const LotLimits& limits) {
  if (!result.trained()) return {result.json.at("why").get<std::string>()};
  std::vector<std::string> violations;
  for (const Json& words : result.json.at("data_quality")) {
    const std::string quality = words, worst = limits.warnings_pass ? "warn" : "pass";
    if (!quality.starts_with("pass") && !quality.starts_with(worst))
      violations.push_back(fmt::format("data quality: {}, expected {}", quality, worst));
  }
  for (const Json& run : result.json.at("judged")) {
    const std::string where =
        fmt::format("{} {}", run.at("role").get<std::string>(), run.at("recording").get<std::string>());
    add_violations(where, run.at("role") == kRepeat ? limits.repeat : limits.other, run.at("measured"), violations);
    const std::string trained_on = run.at("trained_on");
    if (!trained_on.empty()) violations.push_back(fmt::format("{}: not a test: {}", where, trained_on));
  }
  return violations;
}

std::map<std::string, const Task*> chosen(const Lot& lot, const std::vector<ModelChoice>& models) {
  std::map<std::string, const Task*> chosen;
  for (const ModelChoice& model : models) {
    for (const Task& task : lot.tasks) {
      if (task.state() == std::string_view("accepted") && task.model() == model.name)
        chosen.try_emplace(task.gyro(), &task);
    }
  }
  return chosen;
}

Result<Lot> read_lot(const LotFile& file) {
  auto lot = make_plan(file);
  if (!lot) return lot;
  for (Task& task : lot->tasks) {
    if (!has_result(file, task)) continue;
    const std::string path = task_folder(file, task) + "/result.json";
    const auto text = read_text_file(path, kMaxModelBytes);
    if (!text) return tl::unexpected<Error>(text.error());
    try {  // throws if a key that the report needs is missing or has another type
      Json result = Json::parse(*text);
      result.update(task.json);  // the model's name and the directories may be others now
      task.json = std::move(result);
      for (const char* key : {"outcome", task.trained() ? "id" : "why"}) task.json.at(key).get<std::string>();
      if (task.trained()) task.json.at("simulated").get<bool>();
      for (const auto& [quantity, unit] : kQuantities) value_of(task, quantity);
      task.violations = find_violations(task, file.limits);
    } catch (const Json::exception& error) {
      return make_error(path, fmt::format("found {}, expected a result of this version; remove its directory to repeat "
                                          "the task",
                                          error.what()));
    }
  }
  return lot;
}

report::Report lot_report(const LotFile& file, const Lot& lot) {
  report::Report report;
  std::set<std::string> gyros;
  std::size_t missing = 0;
  for (const Task& task : lot.tasks) {
    missing += !task.done();
    if (!task.done()) continue;
    gyros.insert(task.gyro());
    report.simulated = report.simulated || task.json.value("simulated", false);
  }
  report.title = "Campaign " + file.name;
  report.subtitle =
      fmt::format("{} with a result, {} of them with an accepted model; {} without a result",
                  counted(gyros.size(), "gyro"), chosen(lot, file.models).size(), counted(missing, "task"));
  report.tool = "prismcal " + file.version;
  report.facts = {{"asked by", file.asked_by.empty() ? "not stated" : file.asked_by},
                  {"limits, data quality", file.limits.warnings_pass ? "warn" : "pass"},
                  {"limits, repeat", limits_text(file.limits.repeat)},
                  {"limits, other profiles", limits_text(file.limits.other)}};
  for (const auto& [what, why] : lot.left_out) report.facts.emplace_back("left out", what + ": " + why);
  if (missing > 0) report.warning = fmt::format("Lot incomplete: {} without a result.", counted(missing, "task"));
  report.sections = {{"summary", "The lot", {models_table(file, lot), spread_table(file, lot)}},
                     {"verdicts", "Every gyro", {gyros_table(file, lot)}}};
  return report;
}

Result<std::size_t> install_models(const LotFile& file, const Lot& lot, const std::string& folder) {
  std::error_code error;
  std::string target = fs::absolute(folder, error).lexically_normal().string();
  while (target.size() > 1 && target.back() == '/') target.pop_back();
  if (fs::is_symlink(target, error)) target = fs::canonical(target, error).string();
  std::map<std::string, std::string> texts;  // by file name
  Json manifest = {
      {"format", kFormat}, {"version", 1}, {"made", utc_text(std::time(nullptr))}, {"models", Json::array()}};
  for (const auto& [gyro, result] : chosen(lot, file.models)) {
    const std::string name = file_name_of(*result);
    if (texts.contains(name) || name == kManifest)
      return make_error(name, fmt::format("found a second gyro with this file name ({}), expected unique names", gyro));
    const auto text = model_text_of(file, *result);
    if (!text) return tl::unexpected<Error>(text.error());
    texts[name] = *text;
    manifest["models"].push_back(
        {{"file", name}, {"campaign", file.name}, {"asked_by", file.asked_by}, {"limits", file.limits.stated}});
    manifest["models"].back().update(result->json);
    manifest["models"].back()["sha256"] = sha256_hex(*text);
  }
  const std::size_t installed = texts.size();
  const auto others = old_entries(target);
  if (!others) return tl::unexpected<Error>(others.error());
  for (const Json& entry : *others) {
    const std::string name = entry.is_object() ? entry.value("file", "") : "";
    if (name.empty() || name.find('/') != std::string::npos || texts.contains(name)) continue;
    const auto text = read_text_file((fs::path(target) / name).string(), kMaxModelBytes);
    if (!text) return tl::unexpected<Error>(text.error());
    texts[name] = *text;
    manifest["models"].push_back(entry);
  }
  texts[kManifest] = json_text(manifest, 1) + "\n";
  const std::string made = fmt::format("{}.{}.new", target, ::getpid());
  fs::remove_all(made, error);
  Result<void> done;
  if (!fs::create_directories(made, error)) done = make_error(made, error ? error.message() : "cannot be created");
  for (const auto& [name, text] : texts)
    if (done) done = write_text_file((fs::path(made) / name).string(), text);
  const bool exists = fs::exists(target, error);
  if (done && (exists ? ::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE)
                      : ::rename(made.c_str(), target.c_str())) != 0)
    done = make_error(target, fmt::format("cannot be exchanged atomically: {}; unchanged", std::strerror(errno)));
  if (!done || exists) fs::remove_all(made, error);
  return done.map([&] { return installed; });
}

}  // namespace prism::campaign
