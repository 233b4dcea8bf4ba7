// SPDX-License-Identifier: MIT
#include "tools/prismcal/campaign/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "base/file.hpp"

namespace prism::campaign {
namespace {

Result<Descriptor> open_to_append(const std::string& path) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (file.get() < 0) return make_error(path, std::strerror(errno));
  return file;
}

/// The child reads stdin from /dev/null, and no signals are blocked in it.
Result<pid_t> spawn(const std::vector<std::string>& words, int output, int errors) {
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, errors, STDERR_FILENO);
  posix_spawnattr_t attributes;
  ::posix_spawnattr_init(&attributes);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  sigset_t none;
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, arguments[0], &files, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&files);
  if (failed != 0) return make_error(words[0], std::strerror(failed));
  return child;
}

}  // namespace

Result<pid_t> start_program(const std::vector<std::string>& words, const std::string& output) {
  const auto file = open_to_append(output);
  if (!file) return tl::unexpected<Error>(file.error());
  return spawn(words, file->get(), file->get());
}

Result<std::string> output_of(const std::vector<std::string>& words, const std::string& errors) {
  const auto file = open_to_append(errors);
  if (!file) return tl::unexpected<Error>(file.error());
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return make_error("pipe", std::strerror(errno));
  Descriptor from(ends[0]);
  Descriptor to(ends[1]);
  const auto child = spawn(words, to.get(), file->get());
  if (!child) return tl::unexpected<Error>(child.error());
  to.reset();  // only the child has it now: the text ends when the child exits
  auto text = read_text(from, words[0]);
  from.reset();  // a child that still writes gets SIGPIPE and ends
  int status = 0;
  ::waitpid(*child, &status, 0);
  if (status != 0) return make_error(words[0], fmt::format("failed; its message is at the end of {}", errors));
  return text;
}

}  // namespace prism::campaign
