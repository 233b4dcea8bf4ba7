// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <glob.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <utility>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/json_section.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/log_folder.hpp"
#include "tools/prismcal/lot.hpp"

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
  root.allow({"$schema"});
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
  if (!only.empty()) return make_error(only, fmt::format("not a task of {}; --plan names them, and what is left out", file.path));
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
  const auto done = work(task, unfinished).and_then([&](const Json& outcome) {
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

}  // namespace prism::campaign
