// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/task_run.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/utsname.h>

#include <chrono>
#include <filesystem>
#include <new>

#include "base/escape.hpp"
#include "base/file.hpp"

namespace prism::campaign {
namespace {

Result<void> check_inputs(const Task& task) {
  for (const TaskInput& input : task.inputs) {
    if (const auto names = files_of_recording(input.path); names.size() != input.files.size())
      return make_error(input.path, fmt::format("found {} files, expected {} as planned; plan again", names.size(),
                                                input.files.size()));
    for (const InputFile& file : input.files) {
      const auto found = read_input(file.path);
      if (!found) return tl::unexpected<Error>(found.error());
      if (found->sha256 != file.sha256)
        return make_error(file.path, fmt::format("found SHA-256 {:.12}…, expected {:.12}… as planned; plan again",
                                                 found->sha256, file.sha256));
    }
  }
  return {};
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

Json times_json(std::chrono::steady_clock::time_point begin) {
  rusage self{}, children{};
  ::getrusage(RUSAGE_SELF, &self);
  ::getrusage(RUSAGE_CHILDREN, &children);
  utsname machine{};
  ::uname(&machine);
  return {{"wall_s", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()},
          {"cpu_s",
           seconds(self.ru_utime) + seconds(self.ru_stime) + seconds(children.ru_utime) + seconds(children.ru_stime)},
          {"peak_mb", static_cast<double>(self.ru_maxrss) / 1024},
          {"host", machine.nodename}};
}

Result<void> run_in(const ResultStore& store, const Task& task, const Work& work, const std::string& folder) {
  const auto begin = std::chrono::steady_clock::now();
  if (work.version != task.version)
    return make_error(
        task.id, fmt::format("planned with version {}, this is version {}; plan again", task.version, work.version));
  if (auto good = check_inputs(task); !good) return good;
  auto result = work.run(task, folder);
  if (!result) return tl::unexpected<Error>(result.error());
  std::vector<std::pair<std::string, std::string>> files = {{"task.json", json_text(task_json(task), 1) + "\n"},
                                                            {"result.json", result->dump(1) + "\n"},
                                                            {"times.json", json_text(times_json(begin), 1) + "\n"}};
  if (result->contains("why")) files.emplace_back("refused", (*result)["why"].get<std::string>() + "\n");
  for (const auto& [name, text] : files) {
    if (auto done = write_text_file((std::filesystem::path(folder) / name).string(), text); !done) return done;
  }
  return store.publish_task(folder, task.id);
}

}  // namespace

Result<void> run_task(const ResultStore& store, const Task& task, const Work& work) {
  if (store.has_result(task.id)) return {};
  auto folder = store.begin_task(task.id);
  Result<void> done;
  try {
    done = folder ? run_in(store, task, work, *folder) : tl::unexpected<Error>(folder.error());
  } catch (const std::bad_alloc&) {
    done = make_error(task.id, "out of memory");
  }
  if (done) {
    store.clear_failure(task.id);
    return done;
  }
  std::error_code error;
  if (folder) std::filesystem::remove_all(*folder, error);
  if (auto recorded = store.add_failure(task.id, done.error().text()); !recorded) return recorded;
  return done;
}

}  // namespace prism::campaign
