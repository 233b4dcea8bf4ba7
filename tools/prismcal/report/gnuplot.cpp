// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

extern char** environ;

namespace prism::report {
namespace {

namespace fs = std::filesystem;

/// A folder that goes when the scope ends.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code error;
    std::string pattern = (fs::temp_directory_path(error) / "prismcal-XXXXXX").string();
    if (!error && mkdtemp(pattern.data())) path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string whole_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// gnuplot's exit status; 127 where it could not be started.
int run_gnuplot(const fs::path& script, const fs::path& words) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 2, words.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  std::string program = "gnuplot", file = script.string();
  char* arguments[] = {program.data(), file.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return 127;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

Result<std::string> draw_svg(const Plot& plot, const std::string& name) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return refuse("TMPDIR", fmt::format("no temporary folder: {}", std::strerror(errno)));
  const fs::path script = folder.path() / "figure.gp", svg = folder.path() / "figure.svg",
                 words = folder.path() / "words";
  std::ofstream(script, std::ios::binary) << gnuplot_script(plot, name, svg.string());
  const int status = run_gnuplot(script, words);
  if (status == 127) return refuse("gnuplot", "cannot be started; expected Debian's package gnuplot-nox");
  const std::string text = whole_file(svg);
  const auto begin = text.find("<svg");
  const auto end = text.rfind("</svg>");
  if (status != 0 || begin == std::string::npos || end == std::string::npos) {
    return refuse("gnuplot", fmt::format("figure {} failed (status {}): {}", name, status, whole_file(words)));
  }
  return text.substr(begin, end + 6 - begin);
}

}  // namespace prism::report
