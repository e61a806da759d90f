#include "tests/support/service/test_network.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace color3d::testing {
namespace fs = std::filesystem;
namespace {

std::string NamespaceOf(pid_t process) { return fmt::format("/proc/{}/ns/net", process); }

// Starts a process that does nothing in a network namespace of its own.
pid_t StartHolder() {
  int ready[2] = {};
  if (::pipe2(ready, O_CLOEXEC) != 0) throw std::runtime_error("pipe failed");
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const bool is_alone = ::unshare(CLONE_NEWNET) == 0;
    const char answer = is_alone ? '1' : '0';
    static_cast<void>(!::write(ready[1], &answer, 1));
    while (is_alone) ::pause();
    ::_exit(1);
  }
  char answer = '0';
  const ssize_t bytes = ::read(ready[0], &answer, 1);
  ::close(ready[0]);
  ::close(ready[1]);
  if (pid < 0 || bytes != 1 || answer != '1') throw std::runtime_error("unshare failed");
  return pid;
}

}  // namespace

TestNetwork::TestNetwork() {
  if (::geteuid() != 0) {
    problem_ = "network namespaces require root";
    return;
  }
  if (::unshare(CLONE_NEWNET) != 0) {
    problem_ = std::string("unshare: ") + std::strerror(errno);
    return;
  }
  try {
    Run("ip link set lo up");
    Run("ip link add name hub type bridge");
    Run("ip address add 10.77.0.1/24 dev hub");
    Run("ip link set hub up");
  } catch (const std::runtime_error& e) {
    problem_ = e.what();
  }
}

TestNetwork::~TestNetwork() {
  for (const auto& [name, machine] : machines_) {
    ::kill(machine.holder, SIGKILL);
    ::waitpid(machine.holder, nullptr, 0);
  }
}

void TestNetwork::Run(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

const TestNetwork::Machine& TestNetwork::Find(const std::string& machine) const {
  return machines_.at(machine);
}

std::string TestNetwork::Add(const std::string& name) {
  if (machines_.contains(name)) return AddressOf(name);
  Machine machine{StartHolder(), static_cast<int>(machines_.size()) + 11};
  machines_[name] = machine;
  const int n = machine.number;
  Run(fmt::format("ip link add name hub{} type veth peer name eth0 netns {}", n, machine.holder));
  Run(fmt::format("ip link set hub{} master hub up", n));
  const std::string there = "nsenter --net=" + NamespaceOf(machine.holder);
  Run(there + " ip link set lo up");
  Run(fmt::format("{} ip link set eth0 address 02:00:00:00:00:{:02}", there, n));
  Run(fmt::format("{} ip address add {}/24 dev eth0", there, AddressOf(name)));
  Run(there + " ip link set eth0 up");
  return AddressOf(name);
}

std::string TestNetwork::AddressOf(const std::string& machine) const {
  return fmt::format("10.77.0.{}", Find(machine).number);
}

std::string TestNetwork::ProgramOn(const std::string& machine, const std::string& program) const {
  const fs::path script =
      scripts_.path() / fmt::format("on-{}-{}", machine, fs::path(program).filename().string());
  std::ofstream(script) << fmt::format(
      "#!/bin/sh\nexec nsenter --net={} {} \"$@\"\n", NamespaceOf(Find(machine).holder), program);
  ::chmod(script.c_str(), 0755);
  return script.string();
}

TestNetwork::OnMachine::OnMachine(const TestNetwork& network, const std::string& machine)
    : before_(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC)) {
  const int there = ::open(NamespaceOf(network.Find(machine).holder).c_str(), O_RDONLY | O_CLOEXEC);
  if (before_ < 0 || there < 0 || ::setns(there, CLONE_NEWNET) != 0) {
    throw std::runtime_error("cannot enter the network of " + machine);
  }
  ::close(there);
}

TestNetwork::OnMachine::~OnMachine() {
  ::setns(before_, CLONE_NEWNET);
  ::close(before_);
}

void TestNetwork::Cut(const std::string& machine, bool on) {
  Run(fmt::format("ip link set hub{} {}", Find(machine).number, on ? "down" : "up"));
}

// The bridge drops what it would send to the machine.
void TestNetwork::Deafen(const std::string& machine, bool on) {
  const std::string link = fmt::format("hub{}", Find(machine).number);
  // A queue that holds less than a packet.
  Run(on ? fmt::format("tc qdisc add dev {} root tbf rate 8bit burst 1 limit 1", link)
         : fmt::format("tc qdisc del dev {} root", link));
}

void TestNetwork::Slow(const std::string& machine, bool on) {
  const std::string there = "nsenter --net=" + NamespaceOf(Find(machine).holder);
  Run(there + (on ? " tc qdisc add dev eth0 root tbf rate 256kbit burst 8k latency 300ms"
                  : " tc qdisc del dev eth0 root"));
}

}  // namespace color3d::testing
