// A service with scripted workers under faults, and the invariants that must hold meanwhile and in
// the end. Not thread-safe.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "server/storage/blob_store.h"
#include "tests/support/service/server_process.h"

namespace color3d::testing {

// Value of an environment variable; `otherwise` if it is not set.
int64_t FromEnvironment(const char* name, int64_t otherwise);
// COLOR3D_CHAOS_SEED, or the time; printed.
uint64_t ChaosSeed();

// Counts rows of the job store by a statement.
using CountRows = std::function<int64_t(const std::string& sql)>;
// Returns what is wrong after all jobs of a scenario have ended: effects that occur twice, jobs and
// attempts without an end, blobs that are missing or damaged. `effects`: COLOR3D_TEST_EFFECTS;
// `address`: of the store, empty: SQLite; `elsewhere`: blobs that are not in the data folder, or
// null.
std::vector<std::string> AuditJobs(const std::filesystem::path& data_folder,
                                   const std::string& address,
                                   BlobStore* elsewhere,
                                   const std::filesystem::path& effects,
                                   const CountRows& count);
// "20 x worker killed, ..."
std::string DescribeFaults(const std::map<std::string, int>& faults);

enum class Fault {
  kWorkerKilled,
  kWorkerFrozen,
  kWorkerToldToEnd,
  kServerKilled,
  kServerRestarted,
  kDatabaseKilled,  // only of PostgreSQL
};

class ChaosService {
 public:
  // Starts a server on `folder`/data, whose jobs never fail for lost attempts.
  explicit ChaosService(const std::filesystem::path& folder,
                        std::vector<std::string> flags = {},
                        std::string program = COLOR3D_SERVER);
  ~ChaosService();
  ChaosService(const ChaosService&) = delete;
  ChaosService& operator=(const ChaosService&) = delete;

  ServerProcess& server() { return *server_; }
  TestClient& client() { return server_->client(); }

  // Injects one fault of `kinds`, in shuffled rounds, preferably into a worker with a job. Then
  // records problems with the leases in the store.
  void Disturb(Random& random, const std::vector<Fault>& kinds = AllFaults());
  static std::vector<Fault> AllFaults();
  int faults() const;

  // Ends the server and checks its data folder. Returns the problems, one per line.
  std::vector<std::string> EndAndAudit();
  // Number of steps that more than one attempt began; 0: no job was taken over.
  int RepeatedSteps() const;
  int64_t Count(const char* sql) const;
  std::string Faults() const { return DescribeFaults(faults_); }

 private:
  void Start();
  void Restart(int signal);
  void CheckLeases();

  const std::filesystem::path folder_, effects_;
  const std::vector<std::string> flags_;
  const std::string program_;  // of the server
  std::unique_ptr<ServerProcess> server_;
  std::vector<Fault> round_;
  std::map<std::string, int> faults_;
  std::vector<std::string> problems_;
};

// Results of a finished job and its children, without process ids.
std::string ResultOf(TestClient& client, const std::string& job);

}  // namespace color3d::testing
