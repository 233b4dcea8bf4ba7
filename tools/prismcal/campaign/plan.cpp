// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/escape.hpp"
#include "base/json_section.hpp"
#include "base/sha256.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kIdChars = 32;

using Gyros = std::map<std::pair<std::string, std::string>, std::vector<TaskInput>>;

std::string last_name(const std::string& path) {
  const fs::path name(path);
  return (name.has_filename() ? name : name.parent_path()).filename().string();
}

std::string id_of(const Task& task) {
  Json json = {{"version", task.version},   {"serial", task.serial},   {"axis", task.axis},
               {"model", task.model.words}, {"judging", task.judging}, {"report", task.report}};
  for (const TaskInput& input : task.inputs) {
    Json files = Json::array();
    for (const InputFile& file : input.files) files.push_back({last_name(file.path), file.sha256});
    json["inputs"].push_back({role_name(input.role), last_name(input.path), files});
  }
  return sha256_hex(json_text(json)).substr(0, kIdChars);
}

/// Serial number and axis of a recording. Errors: its logs are of several gyros or axes, or have no serial number.
Result<std::pair<std::string, std::string>> owner_of(const TaskInput& input) {
  std::set<std::pair<std::string, std::string>> owners;
  for (const InputFile& file : input.files) {
    if (!file.path.ends_with(".index")) owners.emplace(file.serial, file.axis);
  }
  if (owners.empty()) return make_error(input.path, "found no log of prismd, expected one or more");
  if (owners.size() > 1) return make_error(input.path, "found logs of several gyros or axes, expected those of one");
  if (owners.begin()->first.empty())
    return make_error(input.path, "found no gyro_serial in its log, expected one: a model is bound to it");
  return *owners.begin();
}

Result<void> add_recording(Role role, const std::string& path, Gyros& gyros, Plan& plan) {
  TaskInput input{role, path, {}};
  for (const std::string& name : files_of_recording(path)) {
    auto file = read_input(name);
    if (!file) return tl::unexpected<Error>(file.error());
    input.files.push_back(std::move(*file));
  }
  const auto owner = owner_of(input);
  if (!owner) {
    plan.left_out.push_back({path, owner.error().what});
    return {};
  }
  gyros[*owner].push_back(std::move(input));
  return {};
}

Result<Gyros> find_gyros(const CampaignFile& file, Plan& plan) {
  Gyros gyros;
  for (const RecordingPattern& recording : file.recordings) {
    for (const std::string& pattern : recording.patterns) {
      const auto paths = paths_of_pattern(pattern);
      if (paths.empty()) return make_error(pattern, "matches no file, expected one or more recordings");
      for (const std::string& path : paths) {
        if (auto done = add_recording(recording.role, path, gyros, plan); !done)
          return tl::unexpected<Error>(done.error());
      }
    }
  }
  return gyros;
}

/// The first missing role of a gyro, as a message; empty if it has both.
std::string missing_role(const std::vector<TaskInput>& inputs) {
  for (const Role role : {Role::kTrain, Role::kRepeat}) {
    if (std::none_of(inputs.begin(), inputs.end(), [role](const TaskInput& input) { return input.role == role; }))
      return fmt::format("found no recording with role {}, expected one or more", role_name(role));
  }
  return {};
}

void add_tasks(const CampaignFile& file, const Task& gyro, Plan& plan) {
  for (const ModelChoice& model : file.models) {
    Task task = gyro;
    task.model = model;
    task.id = id_of(task);
    plan.tasks.push_back(std::move(task));
  }
}

}  // namespace

std::vector<std::string> Task::paths(Role role) const {
  std::vector<std::string> found;
  for (const TaskInput& input : inputs) {
    if (input.role == role) found.push_back(input.path);
  }
  return found;
}

Result<Plan> make_plan(const CampaignFile& file, const Work& work) {
  if (auto good = work.check(file); !good) return tl::unexpected<Error>(good.error());
  Plan plan;
  auto gyros = find_gyros(file, plan);
  if (!gyros) return tl::unexpected<Error>(gyros.error());
  for (auto& [owner, inputs] : *gyros) {
    Task task;
    task.serial = owner.first;
    task.axis = owner.second;
    if (const std::string why = missing_role(inputs); !why.empty()) {
      plan.left_out.push_back({task.gyro(), why});
      continue;
    }
    // Sort by role, then as in the campaign file, so that the same campaign gives the same ids.
    std::stable_sort(inputs.begin(), inputs.end(),
                     [](const TaskInput& a, const TaskInput& b) { return a.role < b.role; });
    task.inputs = std::move(inputs);
    task.judging = file.judging;
    task.report = file.reports;
    task.version = work.version;
    ++plan.gyros;
    add_tasks(file, task, plan);
  }
  if (plan.tasks.empty())
    return make_error(file.path,
                      plan.left_out.empty()
                          ? std::string("found no gyro, expected one or more")
                          : fmt::format("found no gyro with train and repeat recordings; first of {} left out: {}: {}",
                                        plan.left_out.size(), plan.left_out[0].what, plan.left_out[0].why));
  return plan;
}

Json task_json(const Task& task) {
  Json json = {{"id", task.id},
               {"serial", task.serial},
               {"axis", task.axis},
               {"model", task.model.name},
               {"train", task.model.words},
               {"judging", task.judging},
               {"version", task.version},
               {"report", task.report}};
  for (const TaskInput& input : task.inputs) {
    Json files = Json::array();
    for (const InputFile& file : input.files) files.push_back({{"path", file.path}, {"sha256", file.sha256}});
    json["inputs"].push_back({{"role", role_name(input.role)}, {"path", input.path}, {"files", files}});
  }
  return json;
}

Result<Task> parse_task(std::string_view text, const std::string& where) {
  const auto document = parse_json_object(text, where);
  if (!document) return tl::unexpected<Error>(document.error());
  const Section root(*document);
  const auto list = [&](const std::string& key) {
    std::vector<std::string> words;
    for (const Json& word : root.any(key))
      words.push_back(word.is_string() ? word.get<std::string>() : json_text(word));
    return words;
  };
  Task task;
  task.id = root.text("id");
  task.serial = root.text("serial");
  task.axis = root.text("axis");
  task.model = {root.text("model"), list("train")};
  task.judging = list("judging");
  task.version = root.text("version");
  task.report = root.boolean("report");
  for (const Section& section : root.objects("inputs")) {
    TaskInput input{static_cast<Role>(section.choice("role", kRoleNames)), section.text("path"), {}};
    for (const Section& file : section.objects("files"))
      input.files.push_back({file.text("path"), file.text("sha256"), {}, {}});
    task.inputs.push_back(std::move(input));
  }
  if (auto done = root.finish(); !done) return tl::unexpected<Error>(done.error());
  return task;
}

}  // namespace prism::campaign
