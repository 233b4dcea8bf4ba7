// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/result_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <functional>

#include "base/escape.hpp"
#include "base/file.hpp"
#include "tools/prismcal/recordings/csv_lines.hpp"

namespace prism::campaign {
namespace {

namespace fs = std::filesystem;

constexpr long kOldUnfinished_s = 86400;

std::string host_name() {
  char name[256] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "unknown";
}

void each_name(const std::string& folder, const std::function<void(const std::string&)>& visit) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    visit(at->path().filename().string());
}

/// Syncs a directory: the names of its entries, not their data.
Result<void> sync(const std::string& path) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) return make_error(path, std::strerror(errno));
  const int failed = ::fsync(opened) == 0 ? 0 : errno;
  ::close(opened);
  if (failed != 0) return make_error(path, std::strerror(failed));
  return {};
}

long age_s(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 ? ::time(nullptr) - found.st_mtim.tv_sec : -1;
}

/// Returns false also for a zombie: its command line is empty.
bool is_alive(const std::string& pid) {
  return !pid.empty() && pid.find_first_not_of("0123456789") == pid.npos &&
         !read_text_file("/proc/" + pid + "/cmdline").value_or("").empty();
}

/// Ids become parts of paths and of shell scripts.
bool is_task_id(const std::string& id) { return !id.empty() && id.find_first_not_of("0123456789abcdef") == id.npos; }

/// `text` as a field of a tab-separated table.
std::string tsv_field(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\t' || c == '\n' || c == '"'; }, ' ');
  return text;
}

std::optional<Failure> read_failure(const std::string& path) {
  Failure failure;
  auto in = FileReader::open(path);
  std::string line;
  if (!in || !in->read_line(line)) return std::nullopt;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), failure.attempts);
  const auto begin = static_cast<std::size_t>(end - line.data());
  if (error != std::errc() || begin + 1 >= line.size()) return std::nullopt;
  failure.why = line.substr(begin + 1);
  return failure;
}

}  // namespace

Result<void> ResultStore::create() const {
  std::error_code error;
  for (const char* name : {"tasks", "failed"}) {
    fs::create_directories(file(name), error);
    if (error) return make_error(file(name), error.message());
  }
  return {};
}

Result<void> ResultStore::write_plan(const Plan& plan) const {
  std::string table = "task\tgyro\tmodel\n", tasks, left_out;
  for (const Task& task : plan.tasks) {
    table += fmt::format("{}\t{}\t{}\n", task.id, tsv_field(task.gyro()), tsv_field(task.model.name));
    tasks += json_text(task_json(task)) + "\n";
  }
  for (const LeftOutInput& input : plan.left_out)
    left_out += tsv_field(input.what) + "\t" + tsv_field(input.why) + "\n";
  for (const auto& [name, text] : {std::pair{"tasks.jsonl", tasks}, {"left_out.tsv", left_out}, {"plan.tsv", table}}) {
    if (auto done = write_text_file(file(name), text); !done) return done;
  }
  return {};
}

Result<std::vector<PlannedTask>> ResultStore::read_plan() const {
  auto in = FileReader::open(file("plan.tsv"));
  if (!in) return make_error(file("plan.tsv"), "no plan yet; run `prismcal campaign FILE --engine print`");
  std::vector<PlannedTask> tasks;
  std::string line;
  in->read_line(line);
  while (in->read_line(line)) {
    const auto fields = recordings::csv_fields(line, '\t');
    if (fields.size() < 3 || !is_task_id(fields[0]))  // plans up to version 0.3 have two more
      return make_error(file("plan.tsv"), fmt::format("found \"{}\", expected a task id, a gyro and a model", line));
    tasks.push_back({fields[0], fields[1], fields[2]});
  }
  return tasks;
}

std::vector<LeftOutInput> ResultStore::read_left_out() const {
  auto in = FileReader::open(file("left_out.tsv"));
  std::vector<LeftOutInput> left_out;
  for (std::string line; in && in->read_line(line);) {
    const auto fields = recordings::csv_fields(line, '\t');
    if (fields.size() == 2) left_out.push_back({fields[0], fields[1]});
  }
  return left_out;
}

Result<Task> ResultStore::read_task(const std::string& id) const {
  auto in = FileReader::open(file("tasks.jsonl"));
  if (!in) return tl::unexpected<Error>(in.error());
  const std::string begin = "{\"id\":\"" + id + "\"";
  for (std::string line; is_task_id(id) && in->read_line(line);) {
    if (line.starts_with(begin)) return parse_task(line, file("tasks.jsonl"));
  }
  return make_error(id, fmt::format("not found in {}; plan changed?", file("tasks.jsonl")));
}

bool ResultStore::has_result(const std::string& id) const { return ::access(task_folder(id).c_str(), F_OK) == 0; }

std::unordered_set<std::string> ResultStore::with_result() const {
  std::unordered_set<std::string> ids;
  each_name(file("tasks"), [&](const std::string& name) {
    if (!name.starts_with(".")) ids.insert(name);
  });
  return ids;
}

std::vector<PlannedTask> ResultStore::tasks_to_do(const std::vector<PlannedTask>& plan) const {
  const auto done = with_result();
  std::vector<PlannedTask> tasks;
  std::copy_if(plan.begin(), plan.end(), std::back_inserter(tasks),
               [&](const PlannedTask& task) { return !done.contains(task.id); });
  return tasks;
}

std::unordered_map<std::string, Failure> ResultStore::failures() const {
  std::unordered_map<std::string, Failure> failures;
  each_name(file("failed"), [&](const std::string& name) {
    if (auto failure = read_failure(file("failed/" + name))) failures[name] = std::move(*failure);
  });
  return failures;
}

std::string ResultStore::refusal(const std::string& id) const {
  std::string line;
  if (auto in = FileReader::open(task_folder(id) + "/refused")) in->read_line(line);
  return line;
}

Result<void> ResultStore::add_failure(const std::string& id, const std::string& why) const {
  const auto before = read_failure(file("failed/" + id));
  return write_text_file(file("failed/" + id),
                         fmt::format("{}\t{}\n", (before ? before->attempts : 0) + 1, why.substr(0, why.find('\n'))));
}

void ResultStore::clear_failure(const std::string& id) const { ::unlink(file("failed/" + id).c_str()); }

Result<std::string> ResultStore::begin_task(const std::string& id) const {
  std::error_code error;
  const std::string unfinished = file(fmt::format("tasks/.{}.{}.{}", id, host_name(), ::getpid()));
  fs::remove_all(unfinished, error);
  if (!fs::create_directories(unfinished, error)) return make_error(unfinished, error.message());
  return unfinished;
}

Result<void> ResultStore::publish_task(const std::string& unfinished, const std::string& id) const {
  std::error_code error;
  std::vector<std::string> folders = {unfinished};
  for (fs::recursive_directory_iterator at(unfinished, error), end; !error && at != end; at.increment(error)) {
    if (at->is_directory(error)) folders.push_back(at->path().string());
  }
  for (const std::string& folder : folders) {
    if (auto done = sync(folder); !done) return done;
  }
  if (::rename(unfinished.c_str(), task_folder(id).c_str()) != 0) {
    const int failed = errno;
    fs::remove_all(unfinished, error);
    if (failed != ENOTEMPTY && failed != EEXIST) return make_error(task_folder(id), std::strerror(failed));
  }
  return sync(file("tasks"));
}

void ResultStore::sweep() const {
  const std::string host = host_name();
  each_name(file("tasks"), [&](const std::string& name) {
    if (!name.starts_with(".")) return;
    const std::string path = file("tasks/" + name);
    const std::size_t dot = name.rfind('.');
    const bool ours = dot != std::string::npos && name.find("." + host + ".") != std::string::npos;
    const bool gone = ours && !is_alive(name.substr(dot + 1));
    std::error_code error;
    if (gone || age_s(path) > kOldUnfinished_s) fs::remove_all(path, error);
  });
}

Result<Status> read_status(const ResultStore& store) {
  const auto plan = store.read_plan();
  if (!plan) return tl::unexpected<Error>(plan.error());
  const auto with_result = store.with_result();
  const auto failures = store.failures();
  Status status;
  status.tasks = plan->size();
  status.left_out = store.read_left_out();
  for (const PlannedTask& task : *plan) {
    if (with_result.contains(task.id)) {
      ++status.done;
      std::string why = store.refusal(task.id);
      if (!why.empty()) status.refused.push_back({task.gyro, task.model, std::move(why)});
    } else if (const auto failed = failures.find(task.id); failed != failures.end()) {
      status.failed.push_back({task.gyro, task.model,
                               failed->second.attempts > 1
                                   ? fmt::format("{} ({} times)", failed->second.why, failed->second.attempts)
                                   : failed->second.why});
    } else {
      ++status.waiting;
    }
  }
  return status;
}

}  // namespace prism::campaign
