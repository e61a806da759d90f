#include "core/base/process/syscall_filter.h"

#include <linux/seccomp.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <initializer_list>
#include <memory>

#include "core/base/error.h"

namespace color3d {
namespace {

// System calls that a decoder does not need: other processes, mounts and namespaces, the kernel
// itself, keys, clocks, and calls that bypass the checks of paths and sockets.
constexpr const char* kRefused[] = {
#ifndef __SANITIZE_ADDRESS__  // its leak detector is a debugger
    "ptrace",
#endif
    "process_vm_readv",
    "process_vm_writev",
    "process_madvise",
    "pidfd_getfd",
    "kcmp",
    "mount",
    "umount",
    "umount2",
    "pivot_root",
    "chroot",
    "move_mount",
    "mount_setattr",
    "open_tree",
    "fsopen",
    "fsconfig",
    "fsmount",
    "fspick",
    "setns",
    "unshare",
    "open_by_handle_at",
    "name_to_handle_at",
    "kexec_load",
    "kexec_file_load",
    "init_module",
    "finit_module",
    "delete_module",
    "bpf",
    "perf_event_open",
    "userfaultfd",
    "io_uring_setup",
    "io_uring_enter",
    "io_uring_register",
    "fanotify_init",
    "add_key",
    "request_key",
    "keyctl",
    "reboot",
    "swapon",
    "swapoff",
    "acct",
    "quotactl",
    "quotactl_fd",
    "settimeofday",
    "stime",
    "clock_settime",
    "clock_adjtime",
    "clock_settime64",
    "clock_adjtime64",
    "sethostname",
    "setdomainname",
    "syslog",
    "iopl",
    "ioperm",
    "modify_ldt",
    "vhangup",
    "uselib",
    "memfd_secret"};

constexpr int kNamespaces[] = {CLONE_NEWUSER,
                               CLONE_NEWNS,
                               CLONE_NEWNET,
                               CLONE_NEWPID,
                               CLONE_NEWIPC,
                               CLONE_NEWUTS,
                               CLONE_NEWCGROUP};

constexpr uint32_t kRefuse = SCMP_ACT_ERRNO(EPERM);

class Filter {
 public:
  Filter() : context_(::seccomp_init(SCMP_ACT_ALLOW), &::seccomp_release) {
    if (!context_) throw Error(ErrorCode::kResourceExhausted, "no memory for a seccomp filter");
    Require(::seccomp_attr_set(context_.get(), SCMP_FLTATR_ACT_BADARCH, kRefuse), "architecture");
  }

  // Skips calls unknown to this architecture or library.
  void Add(uint32_t action, const char* name, std::initializer_list<scmp_arg_cmp> when = {}) {
    const int number = ::seccomp_syscall_resolve_name(name);
    if (number == __NR_SCMP_ERROR) return;
    Require(::seccomp_rule_add_array(
                context_.get(), action, number, static_cast<unsigned>(when.size()), when.begin()),
            name);
  }

  std::vector<sock_filter> Compile() const {
    const int fd = ::memfd_create("filter", MFD_CLOEXEC);
    std::vector<sock_filter> program;
    const int exported = fd < 0 ? -errno : ::seccomp_export_bpf(context_.get(), fd);
    if (exported == 0) {
      program.resize(static_cast<size_t>(::lseek(fd, 0, SEEK_END)) / sizeof(sock_filter));
      const size_t bytes = program.size() * sizeof(sock_filter);
      if (::pread(fd, program.data(), bytes, 0) != static_cast<ssize_t>(bytes)) program.clear();
    }
    if (fd >= 0) ::close(fd);
    if (program.empty()) Require(exported != 0 ? exported : -EIO, "the filter as a whole");
    return program;
  }

 private:
  static void Require(int result, const char* what) {
    if (result == 0) return;
    throw Error(ErrorCode::kInternal, "libseccomp refuses {}: {}", what, std::strerror(-result));
  }

  std::unique_ptr<void, void (*)(void*)> context_;
};

void RefuseSockets(Filter* filter, Sockets allowed) {
  std::vector<int> families;
  if (allowed != Sockets::kNone) families = {AF_UNIX};
  // Host name lookup uses AF_NETLINK.
  if (allowed == Sockets::kAll) families = {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK};
  for (int family = 0; family < AF_MAX; ++family) {
    if (std::find(families.begin(), families.end(), family) != families.end()) continue;
    filter->Add(kRefuse, "socket", {SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(family))});
  }
  filter->Add(kRefuse, "socket", {SCMP_A0(SCMP_CMP_GE, AF_MAX)});
}

}  // namespace

bool HasSyscallFilters() {
  const uint32_t action = SECCOMP_RET_ERRNO;
  return ::syscall(SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &action) == 0;
}

std::vector<sock_filter> CompileSyscallFilter(const SandboxRules& rules) {
  Filter filter;
  for (const char* name : kRefused) filter.Add(kRefuse, name);
  // Its flags are in memory, which filters cannot read; callers fall back to clone.
  filter.Add(SCMP_ACT_ERRNO(ENOSYS), "clone3");
  for (const int flag : kNamespaces) {
    const auto bits = static_cast<scmp_datum_t>(flag);
    filter.Add(kRefuse, "clone", {SCMP_A0(SCMP_CMP_MASKED_EQ, bits, bits)});
  }
  if (!rules.may_start_processes) {
    filter.Add(kRefuse, "fork");
    filter.Add(kRefuse, "vfork");
    filter.Add(kRefuse, "clone", {SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0)});
  }
  RefuseSockets(&filter, rules.sockets);
  // Would inject keystrokes into the server's terminal.
  for (const int request : {TIOCSTI, TIOCLINUX}) {
    filter.Add(kRefuse,
               "ioctl",
               {SCMP_A1(SCMP_CMP_MASKED_EQ, 0xffffffffu, static_cast<scmp_datum_t>(request))});
  }
  return filter.Compile();
}

}  // namespace color3d
