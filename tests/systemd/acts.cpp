// SPDX-License-Identifier: MIT
#include "tests/systemd/acts.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>

namespace prism::test {
namespace {

std::string under(const char* variable, const char* name) {
  const char* folder = std::getenv(variable);
  return std::string(folder == nullptr ? "/nowhere" : folder) + "/" + name;
}

std::function<long()> open_file(const std::string& path, int flags) {
  return [path, flags] {
    return static_cast<long>(::open(path.c_str(), flags | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, 0600));
  };
}
std::function<long()> make_file(const std::string& path) { return open_file(path, O_WRONLY | O_CREAT); }
std::function<long()> make_socket(int family, int type) {
  return [family, type] { return static_cast<long>(::socket(family, type | SOCK_CLOEXEC, 0)); };
}
// A system call with invalid arguments: if it fails with EPERM, a filter has rejected it.
std::function<long()> knock(long number, long a = 0, long b = 0, long c = 0, long d = 0, long e = 0) {
  return [=] { return ::syscall(number, a, b, c, d, e); };
}
std::function<long()> unshare_it(int what) {
  return [what] { return static_cast<long>(::unshare(what)); };
}

long map_writable_code() {
  return ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED
             ? -1
             : 0;
}
long make_memory_executable() {
  void* page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return page == MAP_FAILED ? -1 : ::mprotect(page, 4096, PROT_READ | PROT_EXEC);
}
// In a separate mount namespace if that is permitted, so that the mount disappears with the process.
long mount_tmpfs() {
  if (::unshare(CLONE_NEWNS) == 0) ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
  return ::mount("tmpfs", "/mnt", "tmpfs", 0, nullptr);
}
long set_same_time() {
  timeval now{};
  ::gettimeofday(&now, nullptr);
  return ::settimeofday(&now, nullptr);
}
long set_same_name() {
  char name[65] = {};
  ::gethostname(name, sizeof name - 1);
  return ::sethostname(name, std::char_traits<char>::length(name));
}
long become_real_time() {
  const sched_param parameters{10};
  return ::sched_setscheduler(0, SCHED_FIFO, &parameters);
}
long run_shell() {
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", "exit 7", nullptr);
    ::_exit(1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  errno = EACCES;
  return WIFEXITED(status) && WEXITSTATUS(status) == 7 ? 0 : -1;
}
long set_user_id_bit() {
  const std::string path = under("STATE_DIRECTORY", "suid");
  if (::close(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600)) != 0) return -1;
  return ::chmod(path.c_str(), 04755);
}

}  // namespace

std::vector<Act> acts() {
  constexpr long kBad = -1;
  std::vector<Act> list = {
      {"write_in_logs", true, make_file(under("LOGS_DIRECTORY", "probe"))},
      {"write_in_state", true, make_file(under("STATE_DIRECTORY", "written"))},
      {"unix_socket", true, make_socket(AF_UNIX, SOCK_STREAM)},
      {"open_gyro", true, open_file("/dev/gyro0", O_RDWR)},
      {"open_ttyS", true, open_file("/dev/probe-ttyS", O_RDWR)},
      {"open_ttyUSB", true, open_file("/dev/probe-ttyUSB", O_RDWR)},
      {"open_ttyACM", true, open_file("/dev/probe-ttyACM", O_RDWR)},
      // Files
      {"write_etc", false, make_file("/etc/probe")},
      {"write_configurations", false, make_file("/etc/prism/probe")},
      {"write_usr", false, make_file("/usr/probe")},
      {"write_var_lib", false, make_file("/var/lib/probe")},
      {"read_a_home", false, open_file("/home/probe-secret", O_RDONLY)},
      {"read_roots_home", false, open_file("/root/probe-secret", O_RDONLY)},
      {"read_hosts_tmp", false, open_file("/tmp/probe-secret", O_RDONLY)},
      {"see_other_processes", false, open_file("/proc/1", O_RDONLY | O_DIRECTORY)},
      {"read_their_environment", false, open_file("/proc/1/environ", O_RDONLY)},
      {"write_kernel_settings", false, open_file("/proc/sys/kernel/hostname", O_WRONLY)},
      {"write_sysfs", false, open_file("/sys/kernel/uevent_helper", O_WRONLY)},
      {"read_kernel_log", false, open_file("/dev/kmsg", O_RDONLY)},
      {"run_a_shell", false, run_shell},
      {"set_user_id_bit", false, set_user_id_bit},
      // Devices
      {"open_memory", false, open_file("/dev/mem", O_RDWR)},
      {"open_disk", false, open_file("/dev/probe-disk", O_RDWR)},
      {"open_kvm", false, open_file("/dev/probe-kvm", O_RDWR)},
      {"make_device", false, [] { return static_cast<long>(::mknod("/dev/shm/probe", S_IFCHR | 0600, 0x101)); }},
      // Network
      {"inet_socket", false, make_socket(AF_INET, SOCK_STREAM)},
      {"inet6_socket", false, make_socket(AF_INET6, SOCK_DGRAM)},
      {"netlink_socket", false, make_socket(AF_NETLINK, SOCK_RAW)},
      {"packet_socket", false, make_socket(AF_PACKET, SOCK_RAW)},
      {"vsock_socket", false, make_socket(AF_VSOCK, SOCK_STREAM)},
      // Code and processes
      {"map_writable_code", false, map_writable_code},
      {"make_memory_executable", false, make_memory_executable},
      {"trace", false, [] { return ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr); }},
      {"become_root", false, [] { return static_cast<long>(::setuid(0)); }},
      {"become_real_time", false, become_real_time},
      {"change_personality", false, knock(SYS_personality, 0x0008)},
      // Namespaces
      {"new_user_namespace", false, unshare_it(CLONE_NEWUSER)},
      {"new_mount_namespace", false, unshare_it(CLONE_NEWNS)},
      {"mount", false, mount_tmpfs},
      {"chroot", false, knock(SYS_chroot, 0)},
      // The kernel
      {"set_time", false, set_same_time},
      {"set_host_name", false, set_same_name},
      {"reboot", false, knock(SYS_reboot, 0)},
      {"load_module", false, knock(SYS_init_module, 0, 0, 0)},
      {"load_kernel", false, knock(SYS_kexec_load, 0, 1 << 20, 0, 0)},
      {"swap", false, knock(SYS_swapon, 0)},
      {"bpf", false, knock(SYS_bpf, kBad)},
      {"performance_events", false, knock(SYS_perf_event_open, 0)},
      {"keyring", false, knock(SYS_keyctl, 999)},
      {"io_uring", false, knock(SYS_io_uring_setup, 0, 0)},
      {"userfaultfd", false, knock(SYS_userfaultfd, 0x7fffffff)},
  };
  return list;
}

}  // namespace prism::test
