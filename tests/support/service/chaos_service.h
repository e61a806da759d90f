// A service with scripted workers that is disturbed as services are in their lives, and what must
// hold of it all the while and in the end. Not thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "tests/support/service/server_process.h"

namespace color3d::testing {

// The number in an environment variable; `otherwise` without it.
int64_t FromEnvironment(const char* name, int64_t otherwise);
// COLOR3D_CHAOS_SEED, or the time; printed.
uint64_t ChaosSeed();

enum class Fault {
  kWorkerKilled,
  kWorkerFrozen,
  kWorkerToldToEnd,
  kServerKilled,
  kServerRestarted
};

class ChaosService {
 public:
  // Starts a server on `folder`/data, for whose jobs an attempt lost is no reason to fail.
  explicit ChaosService(const std::filesystem::path& folder, std::vector<std::string> flags = {});
  ~ChaosService();
  ChaosService(const ChaosService&) = delete;
  ChaosService& operator=(const ChaosService&) = delete;

  ServerProcess& server() { return *server_; }
  TestClient& client() { return server_->client(); }

  // Has one fault of those in `kinds`, which come in shuffled rounds; a worker that has a job is
  // preferred. Notes what is wrong with the store's leases afterwards.
  void Disturb(Random& random, const std::vector<Fault>& kinds = AllFaults());
  static std::vector<Fault> AllFaults();
  int faults() const;

  // Ends the server and checks its data folder. Returns the faults, a line each.
  std::vector<std::string> EndAndAudit();
  // Steps that were begun by more than one attempt: without one, nothing was ever taken over.
  int RepeatedSteps() const;
  int64_t Count(const char* sql) const;
  // "20 x worker killed, ..."
  std::string Faults() const;

 private:
  void Start();
  void Restart(int signal);
  void CheckLeases();

  const std::filesystem::path folder_, effects_;
  const std::vector<std::string> flags_;
  std::unique_ptr<ServerProcess> server_;
  std::vector<Fault> round_;
  std::map<std::string, int> faults_;
  std::vector<std::string> problems_;
};

// Results of a finished job and its children, without the processes that ran it.
std::string ResultOf(TestClient& client, const std::string& job);

}  // namespace color3d::testing
