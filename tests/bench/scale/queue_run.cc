#include "tests/bench/scale/queue_run.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/support/service/postgresql_cluster.h"
#include "tests/support/service/processes.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {
using google::protobuf::util::TimeUtil;
using std::chrono::seconds;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::TestClient;

// Seconds of a core that a process has used.
double CpuSecondsOf(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string text{std::istreambuf_iterator<char>(file), {}};
  // The name in parentheses may have spaces.
  const size_t name_end = text.rfind(')');
  if (name_end == std::string::npos) return 0.0;
  std::istringstream words(text.substr(name_end + 1));
  std::string word;
  constexpr int kWordsBeforeTimes = 11;
  for (int i = 0; i < kWordsBeforeTimes; ++i) words >> word;
  double user = 0.0, system = 0.0;
  words >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

double CpuSecondsOf(const std::vector<pid_t>& pids) {
  double sum = 0.0;
  for (const pid_t pid : pids) sum += CpuSecondsOf(pid);
  return sum;
}

// Sets the kind of store that ServerProcess uses, for the life of this object.
class StoreChoice {
 public:
  explicit StoreChoice(const std::string& database) {
    if (database == "postgresql" && !testing::PostgresqlCluster::IsInstalled()) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "PostgreSQL is not installed; install its package (deploy/install-deps.sh), or "
                  "measure sqlite");
    }
    ::setenv("COLOR3D_TEST_STORE", database.c_str(), 1);
  }
  ~StoreChoice() { ::unsetenv("COLOR3D_TEST_STORE"); }
  StoreChoice(const StoreChoice&) = delete;
  StoreChoice& operator=(const StoreChoice&) = delete;
};

class QueueRunner {
 public:
  QueueRunner(int workers, const QueueRunOptions& options)
      : workers_(workers),
        options_(options),
        store_(options.database),
        server_(
            scratch_.path(),
            {"--lease-seconds", "60", "--heartbeat-seconds", "10", "--checkpoint-seconds", "20"},
            options.elsewhere ? 0 : workers) {}

  QueueRun Run() {
    if (options_.elsewhere) StartWorkers();
    const std::string scene = client().MakeScene().name();
    // The jobs read its result, so that none of them plans an import of its own.
    v1::JobSpec import;
    import.set_scene(scene);
    import.mutable_import_scene();
    const std::string imported = client().WaitFinished(client().Create(import).name()).name();
    SetPaused(true);
    const int jobs = workers_ * options_.jobs_per_worker;
    std::string last;
    // It makes progress ten times a second, so that heartbeats are sent as often as they may be.
    const int steps = std::max(1, options_.stage_ms / 100);
    const std::string script = fmt::format("steps={},ms={}", steps, options_.stage_ms / steps);
    for (int i = 0; i < jobs; ++i) {
      v1::JobSpec spec = ScriptedSpec(scene, script, /*seed=*/i + 1);
      spec.add_inputs(imported);
      last = client().Create(spec).name();
    }
    WaitForWorkers();
    const std::vector<pid_t> pids = WorkerPids();
    const double server_before = CpuSecondsOf(server_.pid()), workers_before = CpuSecondsOf(pids);
    SetPaused(false);
    WaitForEnd();
    QueueRun run = Summarize(jobs);
    run.server_cpu = (CpuSecondsOf(server_.pid()) - server_before) / jobs;
    run.worker_cpu = (CpuSecondsOf(pids) - workers_before) / jobs;
    return run;
  }

 private:
  TestClient& client() { return server_.client(); }

  void StartWorkers() {
    for (int i = 0; i < workers_; ++i) {
      const std::string name = fmt::format("w{}", i);
      processes_.push_back(
          std::make_unique<Process>(std::vector<std::string>{COLOR3D_TEST_WORKER,
                                                             "--server",
                                                             server_.address(),
                                                             "--cache-dir",
                                                             scratch_.path() / name,
                                                             "--name",
                                                             name,
                                                             "--log-level",
                                                             "warn"},
                                    scratch_.path() / "logs"));
    }
  }

  void SetPaused(bool paused) {
    grpc::ClientContext context;
    v1::PauseQueueResponse paused_answer;
    v1::ResumeQueueResponse resumed_answer;
    const grpc::Status status = paused ? client().admin->PauseQueue(&context, {}, &paused_answer)
                                       : client().admin->ResumeQueue(&context, {}, &resumed_answer);
    if (!status.ok()) {
      throw Error(ErrorCode::kInternal, "cannot pause or resume: {}", status.error_message());
    }
  }

  void WaitForWorkers() {
    const bool there =
        WaitUntil([&] { return server_.Info().workers_size() >= workers_; }, seconds(120));
    if (there) return;
    std::string said;
    for (const auto& process : processes_) said += process->Err();
    throw Error(ErrorCode::kInternal,
                "{} of {} workers have reached the server: {}",
                server_.Info().workers_size(),
                workers_,
                said);
  }

  std::vector<pid_t> WorkerPids() {
    if (!options_.elsewhere) return server_.Workers();
    std::vector<pid_t> pids;
    for (const auto& process : processes_) pids.push_back(process->pid());
    return pids;
  }

  void WaitForEnd() {
    const bool ended = WaitUntil(
        [&] {
          const v1::ServerInfo info = server_.Info();
          return info.queued_jobs() + info.running_jobs() == 0;
        },
        seconds(options_.limit_seconds),
        std::chrono::milliseconds(500));
    if (!ended) {
      throw Error(
          ErrorCode::kInternal, "the jobs have not ended after {} s", options_.limit_seconds);
    }
  }

  std::vector<v1::Job> EndedJobs() {
    std::vector<v1::Job> jobs;
    v1::ListJobsRequest request;
    request.set_page_size(1000);
    do {
      grpc::ClientContext context;
      v1::ListJobsResponse response;
      const grpc::Status status = client().jobs->ListJobs(&context, request, &response);
      if (!status.ok()) {
        throw Error(ErrorCode::kInternal, "cannot list the jobs: {}", status.error_message());
      }
      for (const v1::Job& job : response.jobs()) {
        if (job.spec().has_select_key_view()) jobs.push_back(job);
      }
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    return jobs;
  }

  QueueRun Summarize(int submitted) {
    std::map<std::string, std::vector<double>> starts;  // by worker, ms
    double first = 1e300, last = 0.0;
    const std::vector<v1::Job> jobs = EndedJobs();
    for (const v1::Job& job : jobs) {
      if (job.state() != v1::Job::STATE_SUCCEEDED || job.attempt() != 1) {
        throw Error(ErrorCode::kInternal,
                    "{} did not succeed in its first attempt: {}",
                    job.name(),
                    job.ShortDebugString());
      }
      const auto start = static_cast<double>(TimeUtil::TimestampToMilliseconds(job.start_time()));
      const auto end = static_cast<double>(TimeUtil::TimestampToMilliseconds(job.end_time()));
      starts[job.worker()].push_back(start);
      first = std::min(first, start);
      last = std::max(last, end);
    }
    if (static_cast<int>(jobs.size()) != submitted) {
      throw Error(ErrorCode::kInternal, "{} of {} jobs are listed", jobs.size(), submitted);
    }
    QueueRun run;
    run.workers = workers_;
    run.jobs = submitted;
    run.seconds = 1e-3 * (last - first);
    run.jobs_per_second = submitted / run.seconds;
    double between = 0.0;
    int64_t pairs = 0;
    for (auto& [worker, times] : starts) {
      const auto [least, most] = std::minmax_element(times.begin(), times.end());
      between += 1e-3 * (*most - *least);
      pairs += static_cast<int64_t>(times.size()) - 1;
    }
    run.seconds_per_job = pairs > 0 ? between / static_cast<double>(pairs) : run.seconds;
    return run;
  }

  const int workers_;
  const QueueRunOptions options_;
  const StoreChoice store_;
  const ScratchFolder scratch_;
  ServerProcess server_;
  std::vector<std::unique_ptr<Process>> processes_;
};

}  // namespace

QueueRun RunQueue(int workers, const QueueRunOptions& options) {
  return QueueRunner(workers, options).Run();
}

}  // namespace color3d
