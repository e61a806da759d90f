// A network of machines inside one machine: network namespaces on a bridge, with links that can be
// cut, deafened and slowed. Requires root. Not thread-safe. Namespaces end with the process.
#pragma once

#include <sys/types.h>

#include <map>
#include <string>

#include "core/base/files.h"

namespace color3d::testing {

class TestNetwork {
 public:
  // Moves this process into a network of its own. Requires: no other threads yet.
  TestNetwork();
  ~TestNetwork();
  TestNetwork(const TestNetwork&) = delete;
  TestNetwork& operator=(const TestNetwork&) = delete;

  // Why the network cannot be used here; empty if it can.
  const std::string& problem() const { return problem_; }

  // Adds a machine, unless there is one of this name, and returns its IPv4 address.
  std::string Add(const std::string& machine);
  std::string AddressOf(const std::string& machine) const;
  // Returns a program that runs `program` on the machine, in the same process.
  std::string ProgramOn(const std::string& machine, const std::string& program) const;

  // Processes started by this thread while it lives run on the machine.
  class OnMachine {
   public:
    OnMachine(const TestNetwork& network, const std::string& machine);
    ~OnMachine();
    OnMachine(const OnMachine&) = delete;
    OnMachine& operator=(const OnMachine&) = delete;

   private:
    int before_ = -1;
  };

  // Cuts the machine off, or connects it again.
  void Cut(const std::string& machine, bool on);
  // Packets to the machine are lost, those from it arrive: connections stay half open.
  void Deafen(const std::string& machine, bool on);
  // Limits what the machine sends to 256 kbit/s.
  void Slow(const std::string& machine, bool on);

 private:
  struct Machine {
    pid_t holder = 0;  // process that keeps the namespace
    int number = 0;    // in addresses and names of links
  };
  void Run(const std::string& command);
  const Machine& Find(const std::string& machine) const;

  std::string problem_;
  std::map<std::string, Machine> machines_;
  ScratchFolder scripts_;
};

}  // namespace color3d::testing
