// Two servers, three workers, PostgreSQL and an object store on machines of their own, while links
// fail, the store errs and everything is killed: each job ends as undisturbed, each effect happens
// once. Requires root (network namespaces), PostgreSQL and Python. COLOR3D_CHAOS_JOBS, _FAULTS and
// _SEED; label "chaos".
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <functional>
#include <map>
#include <set>

#include "core/base/digest.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "server/access/tokens.h"
#include "server/storage/s3/s3_blob_store.h"
#include "server/store/postgresql/postgresql_db.h"
#include "tests/support/service/chaos_service.h"
#include "tests/support/service/postgresql_cluster.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/s3_process.h"
#include "tests/support/service/scripted_trace.h"
#include "tests/support/service/test_certificates.h"
#include "tests/support/service/test_network.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::ChaosSeed;
using ::testing::Contains;
using testing::FromEnvironment;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::PostgresqlCluster;
using testing::S3Process;
using testing::ScriptedSpec;
using testing::SleepMs;
using testing::TestClient;
using testing::TestNetwork;

constexpr int kServers = 2, kWorkers = 3;
constexpr char kScript[] = "steps=8,ms=150";  // longer than a lease
constexpr char kPort[] = ":50551";
constexpr char kBlobPrefix[] = "lab";
constexpr int kFrozenMs = 2500;  // past the lease, its reaping and the next claim

// Calls until it succeeds, at the servers in turn; throws the last error after five minutes.
class AnyServer {
 public:
  AnyServer(const std::vector<std::string>& addresses,
            const fs::path& authority,
            const std::string& token) {
    grpc::SslCredentialsOptions tls;
    tls.pem_root_certs = ReadFile(authority);
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 2000);
    for (const std::string& address : addresses) {
      clients_.push_back(std::make_unique<TestClient>(grpc::CreateCustomChannel(
          address,
          grpc::CompositeChannelCredentials(grpc::SslCredentials(tls),
                                            grpc::AccessTokenCredentials(token)),
          arguments)));
    }
  }
  template <typename Body>
  auto Insist(const Body& body) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(5);
    while (true) {
      try {
        return body(*clients_[turn_++ % clients_.size()]);
      } catch (const std::runtime_error&) {
        if (std::chrono::steady_clock::now() > end) throw;
        SleepMs(200);
      }
    }
  }

 private:
  std::vector<std::unique_ptr<TestClient>> clients_;
  size_t turn_ = 0;
};

class Cluster {
 public:
  Cluster(TestNetwork& network, const fs::path& folder, std::string server_program)
      : network_(network),
        folder_(folder),
        server_program_(std::move(server_program)),
        authority_(folder, "ours") {
    ::setenv("COLOR3D_TEST_EFFECTS", (folder / "effects").c_str(), 1);
    const std::string blobs_host = network_.Add("s3");
    {
      const TestNetwork::OnMachine on(network_, "s3");
      blobs_ = std::make_unique<S3Process>(folder, std::vector<std::string>{}, blobs_host);
    }
    blobs_key_ = blobs_->KeyFile(folder);
    const std::string database_host = network_.Add("db");
    {
      const TestNetwork::OnMachine on(network_, "db");
      database_ = std::make_unique<PostgresqlCluster>(
          std::vector<std::string>{"listen_addresses=" + database_host});
    }
    database_->AllowFrom("10.77.0.0/24");
    address_ = database_->NewDatabase(/*with_tables=*/false);
    store_ = fmt::format("postgresql://postgres@{}/{}?tcp_user_timeout=3000",
                         database_host,
                         address_.substr(address_.rfind('/') + 1));
    tokens_ = folder / "tokens";
    operator_ = AddToken(tokens_, "operator", Role::kAdmin);
    WriteFileAtomic(folder / "token", AddToken(tokens_, "lab", Role::kWorker) + "\n");
    for (int i = 0; i < kServers; ++i) {
      const std::string host = network_.Add(Server(i));
      addresses_.push_back(host + kPort);
      authority_.AddAddress(host);
    }
    certificate_ = authority_.Issue("server");
    for (int i = 0; i < kServers; ++i) StartServer(i);
    for (int i = 0; i < kWorkers; ++i) {
      network_.Add(Worker(i));
      StartWorker(i);
    }
  }
  ~Cluster() { ::unsetenv("COLOR3D_TEST_EFFECTS"); }

  AnyServer Servers() const { return {addresses_, authority_.certificate(), operator_}; }
  int faults() const { return faults_sum_; }
  std::string FaultsText() const { return testing::DescribeFaults(faults_); }

  // Injects one fault, in shuffled rounds of all kinds, and ends it. `frozen_only`: freezes
  // workers.
  void Disturb(Random& random, bool frozen_only);
  // Ends all processes; returns what is wrong with the database, the blobs and the effects.
  std::vector<std::string> EndAndAudit();
  int64_t Count(const std::string& sql) const {
    PostgresqlDatabase db(address_);
    return SqlStatement(db, sql).NextInt();
  }
  int RepeatedSteps() const {
    return testing::RepeatedEffects((folder_ / "effects.begun").string());
  }

 private:
  static std::string Server(int i) { return fmt::format("server{}", i); }
  static std::string Worker(int i) { return fmt::format("worker{}", i); }
  fs::path Data(int i) const { return folder_ / Server(i) / "data"; }

  void StartServer(int i);
  void StartWorker(int i);
  // Brings a killed process back, as an engine or an init system would.
  void Revive() {
    for (int i = 0; i < kServers; ++i) {
      if (!servers_[i]->IsRunning()) StartServer(i);
    }
    for (int i = 0; i < kWorkers; ++i) {
      if (!workers_[i]->IsRunning()) StartWorker(i);
    }
  }
  void Freeze(Process& process, int ms) {
    process.Signal(SIGSTOP);
    SleepMs(ms);
    process.Signal(SIGCONT);
  }

  TestNetwork& network_;
  const fs::path folder_;
  const std::string server_program_;
  testing::TestAuthority authority_;
  testing::CertificateFiles certificate_;
  std::unique_ptr<S3Process> blobs_;
  fs::path blobs_key_;
  std::unique_ptr<PostgresqlCluster> database_;
  std::string address_, store_, operator_;
  fs::path tokens_;
  std::vector<std::string> addresses_;
  std::map<int, std::unique_ptr<Process>> servers_, workers_;
  std::vector<int> round_;
  std::map<std::string, int> faults_;
  int faults_sum_ = 0;
};

void Cluster::StartServer(int i) {
  fs::create_directories(Data(i));
  const std::vector<std::string> arguments = {network_.ProgramOn(Server(i), server_program_),
                                              "serve",
                                              "--data-dir",
                                              Data(i),
                                              "--store",
                                              store_,
                                              "--blobs",
                                              "s3://blobs/" + std::string(kBlobPrefix),
                                              "--s3-endpoint",
                                              blobs_->endpoint(),
                                              "--s3-credentials-file",
                                              blobs_key_,
                                              "--listen",
                                              addresses_[static_cast<size_t>(i)],
                                              "--tls-cert",
                                              certificate_.certificate,
                                              "--tls-key",
                                              certificate_.key,
                                              "--tokens",
                                              tokens_,
                                              "--workers",
                                              "0",
                                              "--lease-seconds",
                                              "1",
                                              "--heartbeat-seconds",
                                              "0.2",
                                              "--checkpoint-seconds",
                                              "0",
                                              "--retry-backoff-ms",
                                              "50",
                                              "--max-attempts",
                                              "1000",
                                              "--reserve-mib",
                                              "0",
                                              "--low-space-mib",
                                              "0",
                                              "--log-level",
                                              "warn"};
  servers_[i] = std::make_unique<Process>(arguments, folder_ / Server(i));
}

void Cluster::StartWorker(int i) {
  const std::string& server = addresses_[static_cast<size_t>(i) % addresses_.size()];
  const std::vector<std::string> arguments = {network_.ProgramOn(Worker(i), COLOR3D_TEST_WORKER),
                                              "--server",
                                              "https://" + server,
                                              "--tls-ca",
                                              authority_.certificate(),
                                              "--token-file",
                                              folder_ / "token",
                                              "--cache-dir",
                                              folder_ / Worker(i),
                                              "--name",
                                              Worker(i)};
  workers_[i] = std::make_unique<Process>(arguments, folder_ / (Worker(i) + "-log"));
}

void Cluster::Disturb(Random& random, bool frozen_only) {
  const auto below = [&](int n) {
    return static_cast<int>(random.NextBelow(static_cast<uint32_t>(n)));
  };
  const int server = below(kServers), worker = below(kWorkers);
  const int pause_ms = 300 + below(2200);  // shorter and longer than a lease
  const auto link = [&](const std::string& machine,
                        void (TestNetwork::*fail)(const std::string&, bool)) {
    (network_.*fail)(machine, true);
    SleepMs(pause_ms);
    (network_.*fail)(machine, false);
  };
  const auto store_fails = [&](const std::string& match, const std::string& fault) {
    blobs_->Fail(match, 1'000'000, fault);
    SleepMs(pause_ms);
    blobs_->EndFaults();
  };
  struct Kind {
    const char* name;
    std::function<void()> inject;
  };
  const std::vector<Kind> kinds = {
      {"worker frozen past its lease", [&] { Freeze(*workers_[worker], kFrozenMs); }},
      {"worker killed", [&] { workers_[worker]->Kill(); }},
      {"worker told to end", [&] { workers_[worker]->Signal(SIGTERM); }},
      {"server killed", [&] { servers_[server]->Kill(); }},
      {"server frozen", [&] { Freeze(*servers_[server], kFrozenMs); }},
      {"server told to end", [&] { servers_[server]->Signal(SIGTERM); }},
      {"database killed",
       [&] {
         const TestNetwork::OnMachine on(network_, "db");
         database_->Kill();
         database_->Start();
       }},
      {"worker cut off", [&] { link(Worker(worker), &TestNetwork::Cut); }},
      {"server cut off", [&] { link(Server(server), &TestNetwork::Cut); }},
      {"database cut off", [&] { link("db", &TestNetwork::Cut); }},
      {"worker deaf", [&] { link(Worker(worker), &TestNetwork::Deafen); }},
      {"server deaf", [&] { link(Server(server), &TestNetwork::Deafen); }},
      {"database deaf", [&] { link("db", &TestNetwork::Deafen); }},
      {"link of a worker slow", [&] { link(Worker(worker), &TestNetwork::Slow); }},
      {"link of a server slow", [&] { link(Server(server), &TestNetwork::Slow); }},
      {"object store cut off", [&] { link("s3", &TestNetwork::Cut); }},
      {"object store answers 503",
       [&] { store_fails("", R"("kind": "status", "status": 503, "code": "SlowDown")"); }},
      {"object store slow", [&] { store_fails("", R"("kind": "late", "seconds": 0.7)"); }},
      {"object store sends half", [&] { store_fails("GET", R"("kind": "truncate")"); }},
      {"object store loses answers", [&] { store_fails("PUT|DELETE", R"("kind": "lose")"); }},
  };
  if (round_.empty()) {
    for (int i = 0; i < static_cast<int>(kinds.size()); ++i) round_.push_back(i);
    for (size_t i = round_.size(); i > 1; --i) {
      std::swap(round_[i - 1], round_[static_cast<size_t>(below(static_cast<int>(i)))]);
    }
  }
  const int kind = frozen_only ? 0 : round_.back();
  kinds[static_cast<size_t>(kind)].inject();
  round_.pop_back();
  ++faults_[kinds[static_cast<size_t>(kind)].name];
  ++faults_sum_;
  Revive();
}

std::vector<std::string> Cluster::EndAndAudit() {
  std::vector<std::string> problems;
  for (auto* group : {&workers_, &servers_}) {
    for (auto& [i, process] : *group) {
      process->Signal(SIGTERM);
      const std::optional<int> status = process->Wait(std::chrono::seconds(60));
      if (status != 0) {
        problems.push_back(fmt::format("process {} of {} ended with {}: {}",
                                       i,
                                       group == &workers_ ? "workers" : "servers",
                                       status.value_or(-1),
                                       process->Err().substr(0, 2000)));
      }
    }
  }
  S3BlobOptions stored;
  stored.s3 = blobs_->Options(kBlobPrefix);
  stored.folder = folder_ / "audit";
  S3BlobStore blobs(stored);
  for (std::string& problem :
       testing::AuditJobs(Data(0), address_, &blobs, folder_ / "effects", [this](const auto& sql) {
         return Count(sql);
       })) {
    problems.push_back(std::move(problem));
  }
  return problems;
}

class ChaosClusterTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    // So that connections are made between the tries of AnyServer.
    ::setenv("GRPC_CLIENT_CHANNEL_BACKUP_POLL_INTERVAL_MS", "100", 1);
    if (PostgresqlCluster::IsInstalled()) network_ = std::make_unique<TestNetwork>();
  }
  static void TearDownTestSuite() { network_.reset(); }
  void SetUp() override {
    if (!network_) GTEST_SKIP() << "NOT TESTED: the programs of PostgreSQL are missing";
    if (!S3Process::IsInstalled()) GTEST_SKIP() << "NOT TESTED: python3 is missing";
    if (!network_->problem().empty()) GTEST_SKIP() << "NOT TESTED: " << network_->problem();
  }

  // Results as undisturbed, whose digests are checked.
  static std::string ResultOf(AnyServer& servers, const std::string& job) {
    return servers.Insist([&](TestClient& client) {
      const v1::Job done = client.Get(job);
      for (const v1::Artifact& artifact : done.artifacts()) {
        const std::string bytes = client.Download(artifact.digest());
        if (Sha256Hex(bytes) != artifact.digest().sha256()) return "damaged: " + artifact.name();
      }
      return testing::ResultOf(client, job);
    });
  }
  static std::vector<std::string> Endure(Cluster& cluster,
                                         int64_t submissions,
                                         int64_t faults,
                                         bool frozen_only);

  static std::unique_ptr<TestNetwork> network_;
  ScratchFolder scratch_;
};
std::unique_ptr<TestNetwork> ChaosClusterTest::network_;

std::vector<std::string> ChaosClusterTest::Endure(Cluster& cluster,
                                                  int64_t submissions,
                                                  int64_t faults,
                                                  bool frozen_only) {
  constexpr int kSubmittedFirst = 20;
  const auto begun = std::chrono::steady_clock::now();
  Random random(ChaosSeed());
  AnyServer servers = cluster.Servers();
  const std::string scene =
      servers.Insist([](TestClient& client) { return client.MakeScene().name(); });
  std::vector<std::string> names;
  const auto submit = [&] {
    const int seed = static_cast<int>(names.size()) + 1;  // distinct work for each job
    // A repeated call with one id makes one job.
    const std::string id = fmt::format("00000000-0000-4000-8000-{:012}", seed);
    names.push_back(servers.Insist([&](TestClient& client) {
      return client.Create(ScriptedSpec(scene, kScript, seed), id).name();
    }));
  };
  const auto wait = [&](const std::string& name) {
    servers.Insist([&](TestClient& client) { return client.WaitFinished(name, 20).name(); });
    return ResultOf(servers, name);
  };
  submit();
  const std::string undisturbed = wait(names[0]);
  const auto submitted = [&] { return static_cast<int64_t>(names.size()); };
  while (submitted() < std::min<int64_t>(kSubmittedFirst, submissions)) submit();
  while (cluster.faults() < faults) {
    SleepMs(100 + static_cast<int>(random.NextBelow(400)));
    cluster.Disturb(random, frozen_only);
    // Keeps work to disturb until the end.
    const int64_t due =
        kSubmittedFirst + (submissions - kSubmittedFirst) * cluster.faults() / faults;
    while (submitted() < std::min(due, submissions)) submit();
  }
  std::vector<std::string> problems;
  for (const std::string& name : names) {
    const std::string result = wait(name);
    if (result != undisturbed) problems.push_back(name + " is not as undisturbed: " + result);
  }
  for (const std::string& problem : cluster.EndAndAudit()) problems.push_back(problem);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
  std::cout << submitted() << " submissions, " << cluster.faults()
            << " faults: " << cluster.FaultsText() << "; "
            << cluster.Count("select count(*) from job_attempt where outcome='LOST'")
            << " attempts lost, " << cluster.RepeatedSteps() << " steps begun anew, "
            << problems.size() << " problems, " << seconds.count() << " s\n";
  return problems;
}

TEST_F(ChaosClusterTest, JobsEndAsUndisturbedWithEffectsOnce) {
  Cluster cluster(*network_, scratch_.path(), COLOR3D_SERVER);
  EXPECT_THAT(Endure(cluster,
                     FromEnvironment("COLOR3D_CHAOS_JOBS", 200),
                     FromEnvironment("COLOR3D_CHAOS_FAULTS", 60),
                     /*frozen_only=*/false),
              IsEmpty());
  EXPECT_GT(cluster.RepeatedSteps(), 0) << "nothing was ever taken over: the test proves nothing";
}

// Negative control: servers that ignore the lease epoch.
TEST_F(ChaosClusterTest, EffectsAreDoubledWithoutFence) {
  Cluster cluster(*network_, scratch_.path(), COLOR3D_UNFENCED_SERVER);
  EXPECT_THAT(Endure(cluster, 40, 12, /*frozen_only=*/true),
              Contains(HasSubstr("effects that occur twice")));
}

}  // namespace
}  // namespace color3d
