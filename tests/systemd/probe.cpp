// SPDX-License-Identifier: MIT
// Tests which operations a sandbox permits. Runs in prismd's unit (as ExecStartPre=) and, as the control, in a unit
// without hardening. Writes one line per attempt to $STATE_DIRECTORY/probe: "forbidden read_kernel_log EPERM", "needed
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

// Returns true if the sandbox rejected the attempt: EPERM or EACCES; ENOENT or EROFS for a hidden or read-only file;
// EAFNOSUPPORT for an address family. Any other error means that it was permitted, because dangerous calls have invalid
// arguments.
bool refused(int error) {
  return error == EPERM || error == EACCES || error == ENOENT || error == EROFS || error == EAFNOSUPPORT;
}

// Runs the attempt in a child, because it may cause a signal or change the process.
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
