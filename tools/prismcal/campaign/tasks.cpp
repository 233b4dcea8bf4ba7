// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/tasks.hpp"

#include <fmt/format.h>
#include <glob.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <map>
#include <new>
#include <set>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "base/json_table.hpp"
#include "base/sha256.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"
#include "tools/prismcal/recordings/log_folder.hpp"
#include "tools/prismcal/recordings/recording.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kIdChars = 32;

const JsonTable<Task>& task_keys() {
  static const auto file =
      JsonTable<InputFile>().text("path", &InputFile::path, "").text("sha256", &InputFile::sha256, "");
  static const auto input = JsonTable<TaskInput>()
                                .choice("role", kRoleNames, &TaskInput::role, "")
                                .text("path", &TaskInput::path, "")
                                .list("files", file, &TaskInput::files, "");
  const auto words = [](auto& task) -> auto& { return task.model.words; };
  static const auto task = JsonTable<Task>()
                               .text("id", &Task::id, "")
                               .text("serial", &Task::serial, "")
                               .text("axis", &Task::axis, "")
                               .text(
                                   "model", [](auto& t) -> auto& { return t.model.name; }, "")
                               .texts("train", words, "")
                               .print_if([](const Task& t) { return !t.model.words.empty(); })
                               .texts("judging", &Task::judging, "")
                               .print_if([](const Task& t) { return !t.judging.empty(); })
                               .text("version", &Task::version, "")
                               .boolean("report", &Task::report, "")
                               .list("inputs", input, &Task::inputs, "");
  return task;
}

std::string last_name(const std::string& path) {
  const fs::path name(path);
  return (name.has_filename() ? name : name.parent_path()).filename().string();
}

std::string id_of(Task task) {
  task.id.clear();
  task.model.name.clear();
  for (TaskInput& input : task.inputs) {
    input.path = last_name(input.path);
    for (InputFile& file : input.files) file.path = last_name(file.path);
  }
  return sha256_hex(task_text(task)).substr(0, kIdChars);
}

/// The file itself, or the logs and their indexes of a folder, sorted by name.
std::vector<std::string> files_of_recording(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<std::string> files = recordings::files_of(path, ".csv");
  for (std::string& index : recordings::files_of(path, ".index")) files.push_back(std::move(index));
  return files;
}

using Owner = std::pair<std::string, std::string>;  // serial number and axis

Owner owner_in_log(const std::string& path) {
  std::string head(8192, '\0');
  auto in = FileReader::open(path);
  head.resize(in ? in->read(head) : 0);
  recordings::Recording log;
  log.add_metadata(head);
  const auto known = [&](const char* key) {
    const std::string value = log.value(key);
    return value == "-" || value == "unknown" ? std::string() : value;
  };
  return {known("gyro_serial"), known("axis")};
}

/// Errors: the files are of several gyros or axes, or have no serial number.
Result<Owner> owner_of(const TaskInput& input, const std::string& serial, const std::string& pattern) {
  if (serial == "*") return Owner(matched_by_star(pattern, input.path), "");
  if (!serial.empty()) return Owner(serial, "");
  std::set<Owner> owners;
  for (const InputFile& file : input.files) {
    if (!file.path.ends_with(".index")) owners.insert(owner_in_log(file.path));
  }
  if (owners.empty()) return make_error(input.path, "found no log of prismd, expected one or more");
  if (owners.size() > 1) return make_error(input.path, "found logs of several gyros or axes, expected those of one");
  if (owners.begin()->first.empty())
    return make_error(input.path,
                      "found no gyro_serial in its log, expected one, or serial in the lot's file: a "
                      "model is bound to it");
  return *owners.begin();
}

using Gyros = std::map<Owner, std::vector<TaskInput>>;

Result<Gyros> find_gyros(const LotFile& file, Plan& plan) {
  Gyros gyros;
  for (const RecordingPattern& recording : file.recordings) {
    for (const std::string& pattern : recording.patterns) {
      glob_t found{};
      const bool any = ::glob(pattern.c_str(), GLOB_BRACE, nullptr, &found) == 0;
      const std::vector<std::string> paths(found.gl_pathv, found.gl_pathv + (any ? found.gl_pathc : 0));
      ::globfree(&found);
      if (!any) return make_error(pattern, "matches no file, expected one or more recordings");
      for (const std::string& path : paths) {
        TaskInput input{recording.role, path, {}};
        for (const std::string& name : files_of_recording(path)) {
          auto sha256 = sha256_of_file(name);
          if (!sha256) return tl::unexpected<Error>(sha256.error());
          input.files.push_back({name, std::move(*sha256)});
        }
        const auto owner = owner_of(input, recording.serial, pattern);
        if (owner) {
          gyros[*owner].push_back(std::move(input));
        } else {
          plan.left_out.push_back({path, owner.error().what});
        }
      }
    }
  }
  return gyros;
}

Result<void> check_inputs(const Task& task) {
  for (const TaskInput& input : task.inputs) {
    if (const auto names = files_of_recording(input.path); names.size() != input.files.size())
      return make_error(input.path, fmt::format("found {} files, expected {} as planned; plan again", names.size(),
                                                input.files.size()));
    for (const InputFile& file : input.files) {
      const auto sha256 = sha256_of_file(file.path);
      if (!sha256) return tl::unexpected<Error>(sha256.error());
      if (*sha256 != file.sha256)
        return make_error(file.path, fmt::format("found SHA-256 {:.12}…, expected {:.12}… as planned; plan again",
                                                 *sha256, file.sha256));
    }
  }
  return {};
}

Json times_json(std::chrono::steady_clock::time_point begin) {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  utsname machine{};
  ::uname(&machine);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {{"wall_s", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()},
          {"cpu_s", seconds(used.ru_utime) + seconds(used.ru_stime)},
          {"peak_mb", static_cast<double>(used.ru_maxrss) / 1024},
          {"host", machine.nodename}};
}

Result<void> run_in(const ResultStore& store, const Task& task, const Work& work, const std::string& folder) {
  const auto begin = std::chrono::steady_clock::now();
  if (work.version != task.version)
    return make_error(
        task.id, fmt::format("planned with version {}, this is version {}; plan again", task.version, work.version));
  if (auto good = check_inputs(task); !good) return good;
  const auto result = work.run(task, folder);
  if (!result) return tl::unexpected<Error>(result.error());
  for (const auto& [name, json] :
       {std::pair{"task.json", task_keys().print(task)}, {"result.json", *result}, {"times.json", times_json(begin)}}) {
    if (auto done = write_text_file(folder + "/" + name, json_text(json, 1) + "\n"); !done) return done;
  }
  return store.publish_task(folder, task.id);
}

/// Ids become parts of paths and of shell scripts.
bool is_task_id(const std::string& id) { return !id.empty() && id.find_first_not_of("0123456789abcdef") == id.npos; }

/// One line of a tab-separated table.
std::string tsv_line(const std::string& id, std::string gyro, std::string model) {
  for (std::string* text : {&gyro, &model})
    std::replace_if(
        text->begin(), text->end(), [](char c) { return c == '\t' || c == '\n' || c == '"'; }, ' ');
  return fmt::format("{}\t{}\t{}\n", id, gyro, model);
}

}  // namespace

std::vector<std::string> Task::paths(Role role) const {
  std::vector<std::string> found;
  for (const TaskInput& input : inputs) {
    if (input.role == role) found.push_back(input.path);
  }
  return found;
}

std::string task_text(const Task& task) { return json_text(task_keys().print(task)); }

Result<Task> parse_task(std::string_view text, const std::string& where) {
  const auto document = parse_json_object(text, where);
  if (!document) return tl::unexpected<Error>(document.error());
  const Section root(*document);
  Task task;
  task_keys().read(root, task);
  if (auto done = root.finish(); !done) return tl::unexpected<Error>(done.error());
  return task;
}

Result<Plan> make_plan(const LotFile& file, const Work& work) {
  if (auto good = work.check(file); !good) return tl::unexpected<Error>(good.error());
  Plan plan;
  auto gyros = find_gyros(file, plan);
  if (!gyros) return tl::unexpected<Error>(gyros.error());
  for (auto& [owner, inputs] : *gyros) {
    Task task{{}, owner.first, owner.second, {}, file.judging, {}, work.version, file.reports};
    // Sort by role, then as in the file, so that the same lot gives the same ids.
    std::stable_sort(inputs.begin(), inputs.end(),
                     [](const TaskInput& a, const TaskInput& b) { return a.role < b.role; });
    task.inputs = std::move(inputs);
    const bool trains = !task.paths(Role::kTrain).empty();
    if (!trains || task.paths(Role::kRepeat).empty()) {
      plan.left_out.push_back({task.gyro(), fmt::format("found no recording with role {}, expected one or more",
                                                        role_name(trains ? Role::kRepeat : Role::kTrain))});
      continue;
    }
    ++plan.gyros;
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

Result<void> ResultStore::write_plan(const Plan& plan) const {
  std::error_code error;
  for (const char* name : {"tasks", "failed"}) {
    fs::create_directories(file(name), error);
    if (error) return make_error(file(name), error.message());
  }
  std::string table = "task\tgyro\tmodel\n", tasks;
  for (const Task& task : plan.tasks) {
    table += tsv_line(task.id, task.gyro(), task.model.name);
    tasks += task_text(task) + "\n";
  }
  for (const LeftOutInput& input : plan.left_out) table += tsv_line("-", input.what, input.why);
  if (auto done = write_text_file(file("tasks.jsonl"), tasks); !done) return done;
  return write_text_file(file("plan.tsv"), table);
}

Result<std::vector<PlannedTask>> ResultStore::read_plan() const {
  auto in = FileReader::open(file("plan.tsv"));
  if (!in) return make_error(file("plan.tsv"), "no plan yet; run `prismcal campaign FILE --engine print`");
  std::vector<PlannedTask> tasks;
  std::string line;
  in->read_line(line);
  while (in->read_line(line)) {
    const auto fields = recordings::csv_fields(line, '\t');
    if (fields.size() < 3 || (fields[0] != "-" && !is_task_id(fields[0])))  // plans up to version 0.3 have two more
      return make_error(file("plan.tsv"), fmt::format("found \"{}\", expected a task id, a gyro and a model", line));
    tasks.push_back({fields[0], fields[1], fields[2]});
  }
  return tasks;
}

Result<Task> ResultStore::read_task(const std::string& id) const {
  auto in = FileReader::open(file("tasks.jsonl"));
  if (!in) return tl::unexpected<Error>(in.error());
  for (std::string line; is_task_id(id) && in->read_line(line);) {
    if (line.starts_with("{\"id\":\"" + id + "\"")) return parse_task(line, file("tasks.jsonl"));
  }
  return make_error(id, fmt::format("not found in {}; plan changed?", file("tasks.jsonl")));
}

bool ResultStore::has_result(const std::string& id) const { return ::access(task_folder(id).c_str(), F_OK) == 0; }

std::string ResultStore::failure(const std::string& id) const {
  std::string why;
  if (auto in = FileReader::open(file("failed/" + id))) in->read_line(why);
  return why;
}

Result<std::string> ResultStore::begin_task(const std::string& id) const {
  char host[256] = {};
  ::gethostname(host, sizeof host - 1);
  std::error_code error;
  const std::string unfinished = file(fmt::format("tasks/.{}.{}.{}", id, host, ::getpid()));
  fs::remove_all(unfinished, error);
  if (!fs::create_directories(unfinished, error)) return make_error(unfinished, error.message());
  return unfinished;
}

Result<void> ResultStore::publish_task(const std::string& unfinished, const std::string& id) const {
  std::error_code error;
  for (fs::recursive_directory_iterator at(unfinished, error), end; !error && at != end; at.increment(error)) {
    if (at->is_directory(error)) sync_directory(at->path().string());
  }
  sync_directory(unfinished);
  if (::rename(unfinished.c_str(), task_folder(id).c_str()) != 0 && errno != ENOTEMPTY && errno != EEXIST)
    return make_error(task_folder(id), std::strerror(errno));
  std::vector<fs::path> left;
  for (fs::directory_iterator at(file("tasks"), error), end; !error && at != end; at.increment(error)) {
    if (at->path().filename().string().starts_with("." + id + ".")) left.push_back(at->path());
  }
  for (const fs::path& folder : left) fs::remove_all(folder, error);
  sync_directory(file("tasks"));
  return {};
}

Result<void> run_task(const ResultStore& store, const Task& task, const Work& work) {
  if (store.has_result(task.id)) return {};
  const auto folder = store.begin_task(task.id);
  Result<void> done;
  try {
    done = folder ? run_in(store, task, work, *folder) : tl::unexpected<Error>(folder.error());
  } catch (const std::bad_alloc&) {
    done = make_error(task.id, "out of memory");
  }
  std::error_code error;
  if (done || store.has_result(task.id)) {  // or another process has finished it meanwhile
    fs::remove(store.file("failed/" + task.id), error);
    return {};
  }
  if (folder) fs::remove_all(*folder, error);
  const std::string text = done.error().text();
  if (auto stored = write_text_file(store.file("failed/" + task.id), text + "\n"); !stored) return stored;
  return done;
}

}  // namespace prism::campaign
