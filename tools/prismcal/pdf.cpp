// SPDX-License-Identifier: MIT
#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "base/file.hpp"
#include "tools/prismcal/document.hpp"

namespace prism::report {
namespace {

/// Runs a program of PATH, without input and output. Returns its status as of waitpid(), or -1 if it does not exist.
int run_quietly(const char* program, std::vector<std::string> options) {
  std::vector<char*> words = {const_cast<char*>(program)};
  for (std::string& option : options) words.push_back(option.data());
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
  pid_t pid = 0;
  int status = -1;
  if (::posix_spawnp(&pid, program, &actions, nullptr, words.data(), environ) == 0) {
    while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
    }
  }
  posix_spawn_file_actions_destroy(&actions);
  return status;
}

}  // namespace

Result<void> print_pdf(const std::string& html, const std::string& path) {
  std::error_code error;
  std::string work = (std::filesystem::temp_directory_path(error) / "prismcal-XXXXXX").string();
  if (::mkdtemp(work.data()) == nullptr) return make_error(work, std::strerror(errno));
  const std::string page = work + "/report.html", made = work + "/report.pdf";
  Result<void> done = write_text_file(page, html);
  if (done) {
    const int status =
        run_quietly("chromium", {"--headless", "--disable-gpu", "--no-pdf-header-footer", "--disable-crash-reporter",
                                 ::geteuid() == 0 ? "--no-sandbox" : "--no-first-run",  // it refuses root with one
                                 "--user-data-dir=" + work + "/profile", "--print-to-pdf=" + made, page});
    if (status == -1)
      done = make_error("--pdf",
                        "found no Chromium, expected it installed; or print report.html (--out) with any browser");
    else if (status != 0 || !std::filesystem::exists(made, error))
      done =
          make_error("--pdf", fmt::format("Chromium ended with status {} and made no PDF; print report.html", status));
    else if (!std::filesystem::copy_file(made, path, std::filesystem::copy_options::overwrite_existing, error))
      done = make_error(path, error.message());
  }
  std::filesystem::remove_all(work, error);
  return done;
}

}  // namespace prism::report
