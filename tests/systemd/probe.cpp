// SPDX-License-Identifier: MIT
// What a sandbox lets a process do. Runs in prismd's place of its unit (a test's ExecStartPre=) and, as the control, in
// a unit without any hardening; a line an act to $STATE_DIRECTORY/probe: "forbidden open_kmsg EPERM", "needed
// unix_socket done".
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/systemd/acts.hpp"

namespace {

// A refusal is EPERM or EACCES; ENOENT or EROFS where the file system hides or seals a thing; EAFNOSUPPORT for a family
// of addresses. Anything else was let through: where success would do harm, the kernel itself cannot serve the
// arguments.
bool refused(int error) {
  return error == EPERM || error == EACCES || error == ENOENT || error == EROFS || error == EAFNOSUPPORT;
}

// In a child: the act may be answered by a signal, and may change the process.
std::string outcome(const prism::test::Act& act) {
  int answer[2];
  if (::pipe(answer) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child == 0) {
    errno = 0;
    const int error = act.run() < 0 ? errno : 0;
    ::_exit(::write(answer[1], &error, sizeof error) == sizeof error ? 0 : 1);
  }
  ::close(answer[1]);
  int error = 0, status = 0;
  const bool told = ::read(answer[0], &error, sizeof error) == sizeof error;
  ::close(answer[0]);
  ::waitpid(child, &status, 0);
  if (!told) return WIFSIGNALED(status) ? std::string("SIG") + ::sigabbrev_np(WTERMSIG(status)) : "no answer";
  if (error == ENOSYS) return "absent";
  return refused(error) ? ::strerrorname_np(error) : "done";
}

}  // namespace

int main() {
  const char* folder = std::getenv("STATE_DIRECTORY");
  if (folder == nullptr || std::getenv("INVOCATION_ID") == nullptr) {
    std::fprintf(stderr,
                 "prism-probe: found no STATE_DIRECTORY and INVOCATION_ID, expected to run in a systemd unit\n");
    return 64;
  }
  std::FILE* report = std::fopen((std::string(folder) + "/probe").c_str(), "w");
  if (report == nullptr) return 1;
  for (const prism::test::Act& act : prism::test::acts()) {
    const std::string line = std::string(act.needed ? "needed " : "forbidden ") + act.name + " " + outcome(act) + "\n";
    std::fputs(line.c_str(), report);
  }
  return std::fclose(report) == 0 ? 0 : 1;
}
