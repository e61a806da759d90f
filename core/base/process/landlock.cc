#include "core/base/process/landlock.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/base/error.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Rights newer than the headers of Debian 12, from the kernel's own.
constexpr uint64_t kTruncate = 1ull << 14;       // ABI 3
constexpr uint64_t kDeviceControl = 1ull << 15;  // ABI 5
constexpr uint64_t kBindTcp = 1ull << 0;         // ABI 4
constexpr uint64_t kConnectTcp = 1ull << 1;
constexpr uint64_t kAbstractSockets = 1ull << 0;  // ABI 6
constexpr uint64_t kSignals = 1ull << 1;

struct RulesetAttributes {
  uint64_t files = 0;
  uint64_t network = 0;  // since ABI 4
  uint64_t scoped = 0;   // since ABI 6: restricted to the same sandbox
};

constexpr uint64_t kRead =
    LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr uint64_t kWrite =
    LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR | LANDLOCK_ACCESS_FS_WRITE_FILE |
    LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_DIR |
    LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
    LANDLOCK_ACCESS_FS_MAKE_SYM | LANDLOCK_ACCESS_FS_REFER | kTruncate;
constexpr uint64_t kOfFiles = LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE |
                              LANDLOCK_ACCESS_FS_WRITE_FILE | kTruncate;

// Parts of the system that programs need. Of /etc no more than this, because it also contains keys
// and tokens.
constexpr const char* kSystem[] = {"/usr",
                                   "/bin",
                                   "/sbin",
                                   "/lib",
                                   "/lib32",
                                   "/lib64",
                                   "/opt",
                                   "/nix/store",
                                   "/proc",
                                   "/sys",
                                   "/dev/urandom",
                                   "/dev/random",
                                   "/etc/alternatives",
                                   "/etc/fonts",
                                   "/etc/gai.conf",
                                   "/etc/group",
                                   "/etc/host.conf",
                                   "/etc/hosts",
                                   "/etc/ld.so.cache",
                                   "/etc/ld.so.preload",
                                   "/etc/localtime",
                                   "/etc/magic",
                                   "/etc/nsswitch.conf",
                                   "/etc/passwd",
                                   "/etc/pki/tls/certs",
                                   "/etc/resolv.conf",
                                   "/etc/services",
                                   "/etc/ssl/certs",
                                   "/etc/ssl/openssl.cnf",
                                   "/etc/timezone",
                                   "/run/systemd/resolve"};

class Ruleset {
 public:
  explicit Ruleset(int abi) {
    handled_ = (kRead | kWrite | LANDLOCK_ACCESS_FS_MAKE_CHAR | LANDLOCK_ACCESS_FS_MAKE_BLOCK);
    if (abi < 3) handled_ &= ~kTruncate;
    if (abi >= 5) handled_ |= kDeviceControl;
  }

  int Open(int abi, Sockets sockets) {
    RulesetAttributes attributes;
    attributes.files = handled_;
    attributes.network = sockets == Sockets::kAll ? kBindTcp : kBindTcp | kConnectTcp;
    attributes.scoped = kAbstractSockets | kSignals;
    const size_t size = abi >= 6 ? 24 : abi >= 4 ? 16 : 8;
    fd_ = static_cast<int>(::syscall(SYS_landlock_create_ruleset, &attributes, size, 0));
    if (fd_ < 0) Fail("a set of rules");
    return fd_;
  }

  // Missing or invisible paths need no rule.
  void Allow(const fs::path& path, uint64_t access) const {
    const int parent = ::open(path.c_str(), O_PATH | O_CLOEXEC);
    if (parent < 0) return;
    struct stat status {};
    ::fstat(parent, &status);
    if (!S_ISDIR(status.st_mode)) access &= kOfFiles;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = access & handled_;
    rule.parent_fd = parent;
    const long added = ::syscall(SYS_landlock_add_rule, fd_, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
    const int error = errno;
    ::close(parent);
    errno = error;
    if (added != 0) Fail(path.string());
  }

 private:
  [[noreturn]] void Fail(const std::string& what) const {
    const int error = errno;
    if (fd_ >= 0) ::close(fd_);
    throw Error(ErrorCode::kInternal, "Landlock refuses {}: {}", what, std::strerror(error));
  }

  uint64_t handled_ = 0;
  int fd_ = -1;
};

}  // namespace

int LandlockAbi() {
  const long abi =
      ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return abi < 0 ? 0 : static_cast<int>(abi);
}

int OpenLandlockRuleset(const SandboxRules& rules, int abi) {
  Ruleset ruleset(abi);
  const int fd = ruleset.Open(abi, rules.sockets);
  for (const char* path : kSystem) ruleset.Allow(path, kRead);
  for (const char* path : {"/dev/null", "/dev/zero"}) ruleset.Allow(path, kWrite);
  for (const fs::path& path : rules.readable) ruleset.Allow(path, kRead);
  for (const fs::path& path : rules.writable) ruleset.Allow(path, kWrite);
  return fd;
}

}  // namespace color3d
