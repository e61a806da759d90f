#include "tests/support/service/chaos_service.h"

#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <iostream>
#include <utility>

#include "server/keeping/fsck.h"
#include "tests/support/service/scripted_trace.h"

namespace color3d::testing {
namespace fs = std::filesystem;
namespace {

constexpr int kWorkers = 3;
constexpr int kFrozenMs = 1300;  // leases last for 1000

// Returns a worker with a job, else any worker, else 0.
pid_t ChooseVictim(ServerProcess& server, Random& random) {
  std::vector<pid_t> busy, all;
  const v1::ServerInfo info = server.Info();
  for (const v1::WorkerInfo& worker : info.workers()) {
    if (worker.worker_id().starts_with("inference-")) continue;
    all.push_back(static_cast<pid_t>(worker.pid()));
    if (!worker.job().empty()) busy.push_back(all.back());
  }
  const std::vector<pid_t>& from = busy.empty() ? all : busy;
  return from.empty() ? 0 : from[random.NextBelow(static_cast<uint32_t>(from.size()))];
}

}  // namespace

int64_t FromEnvironment(const char* name, int64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::atoll(text) : otherwise;
}

uint64_t ChaosSeed() {
  const int64_t seed = FromEnvironment("COLOR3D_CHAOS_SEED", std::time(nullptr));
  std::cout << "seed " << seed << std::endl;
  return static_cast<uint64_t>(seed);
}

std::vector<std::string> AuditJobs(const fs::path& data_folder,
                                   const std::string& address,
                                   BlobStore* elsewhere,
                                   const fs::path& effects,
                                   const CountRows& count) {
  std::vector<std::string> problems;
  const auto require_none = [&](int64_t number, const char* what) {
    if (number != 0) problems.push_back(fmt::format("{}: {}", what, number));
  };
  require_none(RepeatedEffects(effects.string() + ".saved"), "effects that occur twice");
  require_none(count("select count(*) from job where end_ms=0"), "jobs that have not ended");
  require_none(count("select count(*) from job_attempt where end_ms=0"), "attempts without an end");
  require_none(count("select count(*) - count(distinct job_id) from job_attempt where "
                     "outcome='SUCCEEDED'"),
               "jobs that succeeded twice");
  const FsckResult whole = Fsck(data_folder, address, elsewhere, /*repair=*/false, [](int64_t) {});
  require_none(static_cast<int64_t>(whole.store_problems.size()), "problems of the job store");
  require_none(static_cast<int64_t>(whole.missing.size()), "blobs that are missing");
  require_none(static_cast<int64_t>(whole.damaged.size()), "blobs that are damaged");
  return problems;
}

std::string DescribeFaults(const std::map<std::string, int>& faults) {
  std::string text;
  for (const auto& [kind, count] : faults) {
    text += fmt::format("{}{} x {}", text.empty() ? "" : ", ", count, kind);
  }
  return text;
}

ChaosService::ChaosService(const fs::path& folder,
                           std::vector<std::string> flags,
                           std::string program)
    : folder_(folder),
      effects_(folder / "effects"),
      flags_(std::move(flags)),
      program_(std::move(program)) {
  ::setenv("COLOR3D_TEST_EFFECTS", effects_.c_str(), 1);
  Start();
}

ChaosService::~ChaosService() { ::unsetenv("COLOR3D_TEST_EFFECTS"); }

void ChaosService::Start() {
  std::vector<std::string> flags = {"--max-attempts", "1000", "--log-level", "off"};
  flags.insert(flags.end(), flags_.begin(), flags_.end());
  server_ = std::make_unique<ServerProcess>(folder_, flags, kWorkers, 0, program_);
}

void ChaosService::Restart(int signal) {
  server_->Signal(signal);
  const int status = server_->Wait();
  if (signal == SIGTERM && status != 0) {
    problems_.push_back(fmt::format("the server exited with {} after SIGTERM", status));
  }
  Start();
}

std::vector<Fault> ChaosService::AllFaults() {
  std::vector<Fault> faults = {Fault::kWorkerKilled,
                               Fault::kWorkerFrozen,
                               Fault::kWorkerKilled,
                               Fault::kWorkerFrozen,
                               Fault::kWorkerToldToEnd,
                               Fault::kServerKilled,
                               Fault::kWorkerKilled,
                               Fault::kWorkerFrozen,
                               Fault::kWorkerKilled,
                               Fault::kWorkerFrozen,
                               Fault::kWorkerToldToEnd,
                               Fault::kServerRestarted};
  if (TestsUsePostgresql()) faults.insert(faults.end(), 2, Fault::kDatabaseKilled);
  return faults;
}

void ChaosService::Disturb(Random& random, const std::vector<Fault>& kinds) {
  if (round_.empty()) {
    round_ = kinds;
    for (size_t i = round_.size(); i > 1; --i) {
      std::swap(round_[i - 1], round_[random.NextBelow(static_cast<uint32_t>(i))]);
    }
  }
  const Fault fault = round_.back();
  if (fault == Fault::kServerKilled || fault == Fault::kServerRestarted) {
    Restart(fault == Fault::kServerKilled ? SIGKILL : SIGTERM);
    ++faults_[fault == Fault::kServerKilled ? "server killed" : "server restarted"];
  } else if (fault == Fault::kDatabaseKilled) {
    RestartTestDatabase();
    ++faults_["database killed"];
  } else {
    const pid_t victim = ChooseVictim(*server_, random);
    if (victim == 0) return;  // all are starting
    if (fault == Fault::kWorkerKilled) {
      ::kill(victim, SIGKILL);
      ++faults_["worker killed"];
    } else if (fault == Fault::kWorkerFrozen) {
      ::kill(victim, SIGSTOP);
      SleepMs(kFrozenMs);
      ::kill(victim, SIGCONT);
      ++faults_["worker frozen past its lease"];
    } else {
      const int times = random.NextBelow(2) == 0 ? 1 : 5;
      for (int i = 0; i < times; ++i) ::kill(victim, SIGTERM);
      ++faults_["worker told to end"];
    }
  }
  round_.pop_back();
  CheckLeases();
}

int ChaosService::faults() const {
  int sum = 0;
  for (const auto& [kind, count] : faults_) sum += count;
  return sum;
}

void ChaosService::CheckLeases() {
  const int64_t unheld = Count(
      "select count(*) from job where state='RUNNING' and (lease_owner='' or not exists(select 1 "
      "from job_attempt a where a.job_id=job.job_id and a.epoch=job.lease_epoch and a.end_ms=0))");
  if (unheld != 0) problems_.push_back(fmt::format("{} jobs run without a lease", unheld));
  const int64_t open = Count(
      "select count(*) from job_attempt a join job using(job_id) where a.end_ms=0 and "
      "(job.state<>'RUNNING' or job.lease_epoch<>a.epoch)");
  if (open != 0)
    problems_.push_back(fmt::format("{} attempts have not ended with their lease", open));
}

int64_t ChaosService::Count(const char* sql) const {
  const std::unique_ptr<SqlDatabase> db = OpenTestDatabase(folder_ / "data");
  SqlStatement select(*db, sql);
  return select.Step() ? select.Int(0) : -1;
}

std::vector<std::string> ChaosService::EndAndAudit() {
  server_->Signal(SIGTERM);
  const int status = server_->Wait();
  if (status != 0) problems_.push_back(fmt::format("exit status of the server: {}", status));
  const fs::path data = folder_ / "data";
  for (std::string& problem :
       AuditJobs(data, TestStoreAddress(data), nullptr, effects_, [&](const auto& sql) {
         return Count(sql.c_str());
       })) {
    problems_.push_back(std::move(problem));
  }
  return problems_;
}

int ChaosService::RepeatedSteps() const { return RepeatedEffects(effects_.string() + ".begun"); }

std::string ResultOf(TestClient& client, const std::string& job) {
  std::vector<v1::Job> jobs = client.Children(job);
  jobs.push_back(client.Get(job));
  std::string text;
  for (const v1::Job& one : jobs) {
    text += one.kind() + " " + v1::Job::State_Name(one.state()) + "\n";
    for (const v1::Artifact& artifact : one.artifacts()) {
      text += WithoutProcesses(client.Download(artifact.digest()));
    }
  }
  return text;
}

}  // namespace color3d::testing
