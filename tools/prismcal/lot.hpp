// SPDX-License-Identifier: MIT
// A lot of gyros: the lot's file (JSON), its tasks, each gyro with each model, and how one runs; results, violated
// limits, the report, and the installation of accepted models.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/json_document.hpp"
#include "config/version.hpp"
#include "tools/prismcal/document.hpp"
#include "tools/prismcal/limits.hpp"

namespace prism::campaign {

/// Roles of recordings.
inline constexpr const char *kTrain = "train", *kRepeat = "repeat", *kOther = "other";

struct RecordingPattern {
  std::string role, pattern;  ///< absolute shell pattern of logs, folders of logs, or tables
  /// Serial number of their gyro; "*": the text that the only wildcard of the pattern matches; empty: that in the log.
  std::string serial;
};

/// `words`: options of `prismcal train`: "--method=ir-lssvm", "--no-earth-rate".
struct ModelChoice {
  std::string name;
  std::vector<std::string> words;
};

struct LotLimits {
  bool warnings_pass = true;            ///< accepts training recordings with data-quality warnings
  std::vector<analysis::Limit> repeat;  ///< for every recording with role repeat
  std::vector<analysis::Limit> other;   ///< for every recording with role other
  Json stated = Json::object();         ///< as in the file
};

struct LotFile {
  std::string path;  ///< absolute
  std::string name, asked_by;
  std::vector<RecordingPattern> recordings;
  std::vector<ModelChoice> models;   ///< in the order of preference
  std::vector<std::string> judging;  ///< options of `prismcal evaluate`
  LotLimits limits;
  std::string folder;                 ///< output directory, absolute
  bool reports = true;                ///< writes a page for each task
  std::string version = kVersion;     ///< of this program
  std::vector<std::string> warnings;  ///< one per key that has no effect any more
};

/// Paths in the file are relative to its directory. Does not check the options of models and judging, except that none
/// names a file or a gyro. Errors, with the JSON pointer: an unknown or missing key, a value outside its range, no
/// recording of role train or repeat, no model, a serial number "*" with a pattern that has not one * as its only
/// wildcard.
Result<LotFile> parse_lot_file(std::string_view text, const std::string& path);

/// One gyro with one model, and after it has run its result: the object in result.json. docs/campaign.md has the keys.
/// The result depends only on the keys of the task.
struct Task {
  Json json;
  std::vector<std::string> violations = {};  ///< of a result: the lot's limits, one line each. Not stored.

  /// First 32 hex digits of the SHA-256 of the other keys, without the model's name and the directories of the files.
  std::string id() const { return json.at("task"); }
  std::string serial() const { return json.at("serial"); }
  std::string axis() const { return json.at("axis"); }
  std::string gyro() const { return axis().empty() ? serial() : serial() + " " + axis(); }
  std::string model() const { return json.at("model"); }
  std::string name() const { return gyro() + ", " + model(); }
  std::vector<std::string> words(const char* key) const { return json.at(key); }  ///< of "train", "judging"
  std::vector<std::string> paths(std::string_view role) const;
  bool done() const { return json.contains("outcome"); }
  bool trained() const { return done() && json["outcome"] != "refused"; }
  /// "accepted", "rejected" (by a limit), "refused" (by the training) or "to do".
  const char* state() const;
};

struct Lot {
  std::vector<Task> tasks;                                      ///< sorted by gyro; models in the order of the file
  std::vector<std::pair<std::string, std::string>> left_out{};  ///< recordings and gyros without a task, and the reason
};

/// Groups the recordings by serial number and axis, and reads them for their SHA-256. Gyros without a train or repeat
/// recording are listed in Lot::left_out. `only`: the name of the only task to plan. Errors: a file cannot be read, a
/// pattern matches no file, no task is left.
Result<Lot> make_plan(const LotFile& file, const std::string& only = {});

/// FOLDER/tasks/ID: a complete result, renamed into place; FOLDER/tasks/.ID.HOST.PID: an unfinished one. Several
/// processes, also on several machines, can use the folder of a lot at the same time.
std::string task_folder(const LotFile& file, const Task& task);
bool has_result(const LotFile& file, const Task& task);

/// Trains and evaluates; writes the model and the report into `folder`. Returns what result.json has besides the task.
/// Data that training rejects are a result (refused), not an error. Errors: problems of the machine; the task can be
/// retried.
using Work = std::function<Result<Json>(const Task&, const std::string& folder)>;

/// Does the work in a temporary directory and renames it into place: result.json and the files of `work`. Returns at
/// once if the task has a result. Errors: I/O errors, and those of `work`.
Result<void> run_task(const LotFile& file, const Task& task, const Work& work);

// Results.

/// Returns the violated limits of `result`, one line each. A value that could not be measured violates its limit. An
/// evaluation on training data is also listed.
std::vector<std::string> find_violations(const Task& result, const LotLimits& limits);

/// For each gyro the result of the first accepted model in the order of `models`. Gyros without one are omitted.
std::map<std::string, const Task*> chosen(const Lot& lot, const std::vector<ModelChoice>& models);

/// The plan with its results so far. Errors: those of make_plan(), a result that cannot be read, or one of another
/// version.
Result<Lot> read_lot(const LotFile& file);

/// The lot by model, distributions with outliers, and every gyro with every model. Links to tasks' pages are relative
/// to FOLDER/report.
report::Report lot_report(const LotFile& file, const Lot& lot);

/// Writes the chosen model of each gyro to `folder` as SERIAL.json or SERIAL-AXIS.json, and manifest.json with their
/// SHA-256, results, limits and "asked_by"; keeps the models of other gyros. Prepares a new folder and exchanges it
/// atomically, so that readers see either all old or all new files. Errors: a model is not the evaluated one or belongs
/// to another gyro, two gyros have the same file name, `folder` has files but no manifest, or the file system cannot
/// exchange folders. Returns the number of models of the lot.
Result<std::size_t> install_models(const LotFile& file, const Lot& lot, const std::string& folder);

}  // namespace prism::campaign
