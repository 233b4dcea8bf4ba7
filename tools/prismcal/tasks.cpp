// SPDX-License-Identifier: MIT
#include "tools/prismcal/tasks.hpp"

#include <fmt/format.h>
#include <glob.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <new>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_document.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/log_folder.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kIdChars = 32;

// Tasks and results as JSON.

Json task_json(const Task& task) {
  Json json = {{"task", task.id},          {"serial", task.serial},     {"axis", task.axis},
               {"model", task.model.name}, {"train", task.model.words}, {"judging", task.judging},
               {"version", task.version},  {"report", task.report},     {"inputs", Json::array()}};
  for (const TaskInput& input : task.inputs) {
    Json files = Json::array();
    for (const InputFile& file : input.files) files.push_back({{"path", file.path}, {"sha256", file.sha256}});
    json["inputs"].push_back({{"role", role_name(input.role)}, {"path", input.path}, {"files", files}});
  }
  return json;
}

Task task_of(const Json& json) {
  const char* const id = json.contains("task") ? "task" : "id";  // version 0.3
  Task task{json.at(id), json.at("serial"),  json.at("axis"),  {json.at("model"), json.at("train")}, json.at("judging"),
            {},          json.at("version"), json.at("report")};
  for (const Json& input : json.at("inputs")) {
    const auto role = std::find(kRoleNames.begin(), kRoleNames.end(), input.at("role").get<std::string>());
    task.inputs.push_back({static_cast<Role>(role - kRoleNames.begin()), input.at("path"), {}});
    for (const Json& file : input.at("files")) task.inputs.back().files.push_back({file.at("path"), file.at("sha256")});
  }
  return task;
}

TaskResult result_of(const Json& json, const Task& task) {
  const auto number = [](const Json& value) {
    return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
  };
  TaskResult result;
  result.task = task;  // its current name of the model: the stored one may be older, since the id does not contain it
  result.level = json.at("level");
  if (json.at("outcome") == "refused") {
    result.refused = json.at("why");
    return result;
  }
  result.id = json.at("id");
  result.simulated = json.at("simulated");
  result.data_quality = json.at("data_quality");
  result.mean_deg_per_h = number(json.at("training").at("mean_deg_per_h"));
  json.at("training").at("curve_degc_deg_per_h").get_to(result.curve);
  for (const Json& judged : json.at("judged")) {
    RecordingResult recording{judged.at("role"), judged.at("recording"), judged.at("trained_on"), {}};
    for (const auto& [quantity, value] : judged.at("measured").items())
      recording.measured.push_back({quantity, "", number(value)});
    result.evaluations.push_back(std::move(recording));
  }
  return result;
}

/// The value that `read` makes of JSON text. Errors: the text has other contents than those expected.
template <class Read>
auto parsed(const std::string& text, const std::string& where, const char* expected, const Read& read)
    -> Result<decltype(read(Json()))> {
  try {
    return read(Json::parse(text));
  } catch (const Json::exception& error) {
    return make_error(where, fmt::format("found {}, expected {}", error.what(), expected));
  }
}

// The plan.

std::string last_name(const std::string& path) {
  const fs::path name(path);
  return (name.has_filename() ? name : name.parent_path()).filename().string();
}

std::string id_of(Task task) {
  task.id = task.model.name = "";
  for (TaskInput& input : task.inputs) {
    input.path = last_name(input.path);
    for (InputFile& file : input.files) file.path = last_name(file.path);
  }
  return sha256_hex(json_text(task_json(task))).substr(0, kIdChars);
}

/// The file itself, or the logs and their indexes of a folder, sorted by name. Errors: a file cannot be read.
Result<std::vector<InputFile>> files_of_recording(const std::string& path) {
  std::error_code error;
  std::vector<std::string> names = {path};
  if (fs::is_directory(path, error)) {
    names = recordings::files_of(path, ".csv");
    for (std::string& index : recordings::files_of(path, ".index")) names.push_back(std::move(index));
  }
  std::vector<InputFile> files;
  for (std::string& name : names) {
    auto sha256 = sha256_of_file(name);
    if (!sha256) return tl::unexpected<Error>(sha256.error());
    files.push_back({std::move(name), std::move(*sha256)});
  }
  return files;
}

using Owner = std::pair<std::string, std::string>;  // serial number and axis

/// Errors: the files are of several gyros or axes, or have no serial number.
Result<Owner> owner_of(const std::string& path, const std::string& serial, const std::string& pattern) {
  if (serial == "*") return Owner(matched_by_star(pattern, path), "");
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

using Gyros = std::map<Owner, std::vector<TaskInput>>;

/// Adds the recordings of a pattern. Errors: it matches no file, or a file cannot be read.
Result<void> add_recordings(const RecordingPattern& recording, const std::string& pattern, Gyros& gyros, Plan& plan) {
  glob_t found{};
  const bool any = ::glob(pattern.c_str(), GLOB_BRACE, nullptr, &found) == 0;
  const std::vector<std::string> paths(found.gl_pathv, found.gl_pathv + (any ? found.gl_pathc : 0));
  ::globfree(&found);
  if (!any) return make_error(pattern, "matches no file, expected one or more recordings");
  for (const std::string& path : paths) {
    auto files = files_of_recording(path);
    if (!files) return tl::unexpected<Error>(files.error());
    if (const auto owner = owner_of(path, recording.serial, pattern))
      gyros[*owner].push_back({recording.role, path, std::move(*files)});
    else
      plan.left_out.push_back({path, owner.error().what});
  }
  return {};
}

// Running a task.

/// Renames the result into place, and removes what killed processes left of this task. Keeps a result that another
/// process has finished meanwhile.
Result<void> publish(const std::string& unfinished, const std::string& folder, const std::string& id) {
  sync_directory(unfinished);
  const std::string target = task_folder(folder, id);
  if (::rename(unfinished.c_str(), target.c_str()) != 0 && errno != ENOTEMPTY && errno != EEXIST)
    return make_error(target, std::strerror(errno));
  std::error_code error;
  std::vector<fs::path> left;
  for (fs::directory_iterator at(folder + "/tasks", error), end; !error && at != end; at.increment(error)) {
    if (at->path().filename().string().starts_with("." + id + ".")) left.push_back(at->path());
  }
  for (const fs::path& path : left) fs::remove_all(path, error);
  sync_directory(folder + "/tasks");
  return {};
}

Result<void> run_in(const std::string& unfinished, const LotFile& file, const Task& task, const Work& work) {
  std::error_code error;
  fs::remove_all(unfinished, error);
  if (!fs::create_directories(unfinished, error)) return make_error(unfinished, error.message());
  if (file.version != task.version)
    return make_error(
        task.id, fmt::format("planned with version {}, this is version {}; plan again", task.version, file.version));
  for (const TaskInput& input : task.inputs) {
    const auto files = files_of_recording(input.path);
    if (!files) return tl::unexpected<Error>(files.error());
    if (*files != input.files) return make_error(input.path, "changed since the plan; plan again");
  }
  const auto result = work(task, unfinished);
  if (!result) return tl::unexpected<Error>(result.error());
  if (auto done = write_text_file(unfinished + "/result.json", json_text(result_json(*result), 1) + "\n"); !done)
    return done;
  return publish(unfinished, file.folder, task.id);
}

}  // namespace

std::vector<std::string> Task::paths(Role role) const {
  std::vector<std::string> found;
  for (const TaskInput& input : inputs) {
    if (input.role == role) found.push_back(input.path);
  }
  return found;
}

Result<Plan> make_plan(const LotFile& file) {
  Plan plan;
  Gyros gyros;
  for (const RecordingPattern& recording : file.recordings) {
    for (const std::string& pattern : recording.patterns) {
      if (auto done = add_recordings(recording, pattern, gyros, plan); !done)
        return tl::unexpected<Error>(done.error());
    }
  }
  for (auto& [owner, inputs] : gyros) {
    // Sort by role, then as in the file, so that the same lot gives the same ids.
    std::stable_sort(inputs.begin(), inputs.end(),
                     [](const TaskInput& a, const TaskInput& b) { return a.role < b.role; });
    Task task{{}, owner.first, owner.second, {}, file.judging, std::move(inputs), file.version, file.reports};
    const bool trains = !task.paths(Role::kTrain).empty();
    if (!trains || task.paths(Role::kRepeat).empty()) {
      plan.left_out.push_back({task.gyro(), fmt::format("found no recording with role {}, expected one or more",
                                                        role_name(trains ? Role::kRepeat : Role::kTrain))});
      continue;
    }
    for (const ModelChoice& model : file.models) {
      task.model = model;
      task.id = id_of(task);
      plan.tasks.push_back(task);
    }
  }
  if (plan.tasks.empty())
    return make_error(file.path,
                      plan.left_out.empty()
                          ? std::string("found no gyro, expected one or more")
                          : fmt::format("found no gyro with train and repeat recordings; first of {} left out: {}: {}",
                                        plan.left_out.size(), plan.left_out[0].what, plan.left_out[0].why));
  return plan;
}

Json result_json(const TaskResult& result) {
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  Json json = task_json(result.task);
  json.update({{"level", result.level}, {"outcome", result.refused.empty() ? "trained" : "refused"}});
  if (!result.refused.empty()) {
    json["why"] = result.refused;
    return json;
  }
  json.update(
      {{"id", result.id},
       {"simulated", result.simulated},
       {"data_quality", result.data_quality},
       {"training", {{"mean_deg_per_h", number(result.mean_deg_per_h)}, {"curve_degc_deg_per_h", result.curve}}},
       {"judged", Json::array()}});
  for (const RecordingResult& recording : result.evaluations) {
    Json measured = Json::object();
    for (const analysis::Measured& m : recording.measured) measured[m.quantity] = number(m.value);
    json["judged"].push_back({{"role", recording.role},
                              {"recording", recording.recording},
                              {"trained_on", recording.trained_on},
                              {"measured", measured}});
  }
  return json;
}

std::string task_folder(const std::string& folder, const std::string& id) { return folder + "/tasks/" + id; }

bool has_result(const std::string& folder, const std::string& id) {
  return ::access(task_folder(folder, id).c_str(), F_OK) == 0;
}

std::string failure(const std::string& folder, const std::string& id) {
  std::string why;
  if (auto in = FileReader::open(folder + "/failed/" + id)) in->read_line(why);
  return why;
}

Result<void> write_plan(const std::string& folder, const Plan& plan) {
  std::error_code error;
  for (const char* name : {"/tasks", "/failed"}) {
    fs::create_directories(folder + name, error);
    if (error) return make_error(folder + name, error.message());
  }
  std::string lines;
  for (const Task& task : plan.tasks) lines += json_text(task_json(task)) + "\n";
  for (const LeftOutInput& input : plan.left_out)
    lines += json_text(Json{{"left_out", input.what}, {"why", input.why}}) + "\n";
  return write_text_file(folder + "/tasks.jsonl", lines);
}

Result<Plan> read_plan(const std::string& folder, const std::string& id) {
  const std::string path = folder + "/tasks.jsonl";
  auto in = FileReader::open(path);
  if (!in) return make_error(path, "no plan yet; run `prismcal campaign FILE --engine print`");
  Plan plan;
  for (std::string line; in->read_line(line);) {
    if (!id.empty() && !line.starts_with("{\"task\":\"" + id + "\"")) continue;
    const auto added = parsed(line, path, "a line of a plan; plan again", [&](const Json& json) {
      if (json.contains("left_out"))
        plan.left_out.push_back({json["left_out"], json.at("why")});
      else
        plan.tasks.push_back(task_of(json));
      return true;
    });
    if (!added) return tl::unexpected<Error>(added.error());
  }
  for (const Task& task : plan.tasks) {  // ids become parts of paths and of shell scripts
    if (task.id.find_first_not_of("0123456789abcdef") != std::string::npos)
      return make_error(path, fmt::format("found the task \"{}\", expected hex digits", task.id));
  }
  if (!id.empty() && plan.tasks.empty()) return make_error(id, fmt::format("not found in {}; plan changed?", path));
  return plan;
}

Result<TaskResult> read_result(const std::string& folder, const Task& task) {
  const std::string path = task_folder(folder, task.id) + "/result.json";
  return read_text_file(path, kMaxModelBytes).and_then([&](const std::string& text) {
    return parsed(text, path, "a result of this version; remove its directory to repeat the task",
                  [&](const Json& json) { return result_of(json, task); });
  });
}

Result<void> run_task(const LotFile& file, const Task& task, const Work& work) {
  if (has_result(file.folder, task.id)) return {};
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  const std::string unfinished = fmt::format("{}/tasks/.{}.{}.{}", file.folder, task.id, host, ::getpid());
  const std::string failed = file.folder + "/failed/" + task.id;
  Result<void> done;
  try {
    done = run_in(unfinished, file, task, work);
  } catch (const std::bad_alloc&) {
    done = make_error(task.id, "out of memory");
  }
  std::error_code error;
  if (done || has_result(file.folder, task.id)) {  // or another process has finished it meanwhile
    fs::remove(failed, error);
    return {};
  }
  fs::remove_all(unfinished, error);
  if (auto stored = write_text_file(failed, done.error().text() + "\n"); !stored) return stored;
  return done;
}

}  // namespace prism::campaign
