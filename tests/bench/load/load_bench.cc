// color3d-load-bench: calls per second and latency of a server with a long history in its store,
// watchers, and a busy worker. Prints JSON.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/base/random.h"
#include "server/storage/data_folder.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"
#include "tests/support/service/rpc_support.h"
#include "tests/support/service/server_process.h"

namespace color3d {
namespace {

using std::chrono::duration;
using SteadyClock = std::chrono::steady_clock;
using testing::ScriptedSpec;
using testing::ServerProcess;
using testing::TestClient;

struct LoadOptions {
  int64_t jobs = 1'000'000;
  int watchers = 300;
  int threads = 16;
  double seconds = 10.0;
  double rate = 0.0;  // calls of GetJob per second, in total; 0: unlimited
};

std::string PastJob(int64_t i) { return fmt::format("jobs/{:016x}", i); }

// Adds finished jobs, each with a result, an attempt and an event.
void WriteHistory(const std::filesystem::path& data_folder, int64_t jobs) {
  const DataPaths paths(data_folder);
  PrepareDataFolder(paths);
  { SqliteJobStore(paths.Store(), StoreRole::kServer, SystemClocks()); }
  SqliteDatabase db(paths.Store(), SqliteAccess::kWrite);
  SqliteTransaction transaction(db);
  const std::string numbers = fmt::format(
      "with recursive n(i) as (select 1 union all select i+1 from n where i<{}) ", jobs);
  const int64_t now = SystemClock()();
  db.Run(
      "insert into job(job_id,name,kind,scene,spec,state,stage_key,create_ms,start_ms,end_ms,"
      "revision) " +
          numbers +
          "select i,printf('jobs/%016x',i),'import_scene','scenes/past',x'','SUCCEEDED',"
          "printf('%064x',i),?1,?1,?1,i from n",
      now);
  db.Run("insert into artifact " + numbers +
         "select i,'scene.json',printf('%064x',i),1,'application/json' from n");
  db.Run("insert into job_attempt " + numbers + "select i,1,'w',?1,?1,'SUCCEEDED' from n", now);
  db.Run("insert into job_event " + numbers + "select i,i,0,'SUCCEEDED',1,?1 from n", now);
  transaction.Commit();
}

// Milliseconds.
class Latencies {
 public:
  void Add(double ms) {
    std::lock_guard lock(mutex_);
    values_.push_back(ms);
  }
  nlohmann::ordered_json Summary(double seconds) {
    std::sort(values_.begin(), values_.end());
    const auto at = [&](double share) {
      return values_.empty() ? 0.0 : values_[static_cast<size_t>(share * (values_.size() - 1))];
    };
    return {{"calls", values_.size()},
            {"calls_per_second", static_cast<double>(values_.size()) / seconds},
            {"p50_ms", at(0.5)},
            {"p99_ms", at(0.99)},
            {"max_ms", at(1.0)}};
  }

 private:
  std::mutex mutex_;
  std::vector<double> values_;
};

template <class Body>
void Timed(Latencies& latencies, Body&& body) {
  const auto start = SteadyClock::now();
  body();
  latencies.Add(duration<double, std::milli>(SteadyClock::now() - start).count());
}

nlohmann::ordered_json Run(const LoadOptions& options) {
  const ScratchFolder scratch;
  const auto begun = SteadyClock::now();
  WriteHistory(scratch.path() / "data", options.jobs);
  nlohmann::ordered_json result = {{"jobs_in_store", options.jobs},
                                   {"watchers", options.watchers},
                                   {"client_threads", options.threads},
                                   {"asked_rate", options.rate}};
  result["filling_s"] = duration<double>(SteadyClock::now() - begun).count();
  ServerProcess server(scratch.path(), {"--lease-seconds", "60", "--heartbeat-seconds", "1"});
  TestClient& client = server.client();
  const std::string scene = client.MakeScene().name();
  // A job that runs and is watched during the measurement.
  const std::string busy = client.Create(ScriptedSpec(scene, "steps=100000,ms=20")).name();

  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::thread> watchers;
  std::atomic<int64_t> events{0};
  for (int i = 0; i < options.watchers; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    watchers.emplace_back([&client, &events, &busy, context = contexts.back().get()] {
      v1::WatchJobsRequest request;
      request.add_names(busy);
      const auto stream = client.jobs->WatchJobs(context, request);
      for (v1::JobEvent event; stream->Read(&event);) ++events;
      stream->Finish();
    });
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));

  Latencies gets, creates;
  std::atomic<bool> over{false};
  std::atomic<int64_t> failed{0};
  std::vector<std::thread> callers;
  events = 0;
  for (int t = 0; t < options.threads; ++t) {
    callers.emplace_back([&, t] {
      TestClient own(server.address());
      Random random(static_cast<uint64_t>(t) + 1);
      auto next = SteadyClock::now();
      while (!over) {
        if (options.rate > 0.0) {
          std::this_thread::sleep_until(next);
          next += std::chrono::duration_cast<SteadyClock::duration>(
              duration<double>(options.threads / options.rate));
        }
        const std::string name =
            random.NextUniform() < 0.5
                ? busy
                : PastJob(1 + static_cast<int64_t>(random.NextUniform() * (options.jobs - 1)));
        Timed(gets, [&] {
          v1::GetJobRequest request;
          request.set_name(name);
          grpc::ClientContext context;
          v1::Job job;
          if (!own.jobs->GetJob(&context, request, &job).ok()) ++failed;
        });
      }
    });
  }
  callers.emplace_back([&] {
    for (int seed = 2; !over; ++seed) {
      Timed(creates, [&] { client.Create(ScriptedSpec(scene, "steps=1", seed)); });
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  const auto start = SteadyClock::now();
  std::this_thread::sleep_for(duration<double>(options.seconds));
  over = true;
  for (std::thread& caller : callers) caller.join();
  const double seconds = duration<double>(SteadyClock::now() - start).count();
  result["get_job"] = gets.Summary(seconds);
  result["create_job"] = creates.Summary(seconds);
  result["failed_calls"] = failed.load();
  result["watch_events_per_second"] = static_cast<double>(events.load()) / seconds;
  result["server_memory_mib"] = server.Info().memory_bytes() >> 20;
  for (const auto& context : contexts) context->TryCancel();
  for (std::thread& watcher : watchers) watcher.join();
  return result;
}

int Main(int argc, char** argv) {
  LoadOptions options;
  CLI::App app("Measure the load that a color3d server with a long history answers.");
  app.add_option("--jobs", options.jobs, "Finished jobs in the store")->capture_default_str();
  app.add_option("--watchers", options.watchers, "Watchers of a running job")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "Threads that call GetJob")->capture_default_str();
  app.add_option("--rate", options.rate, "Calls of GetJob per second; 0: unlimited")
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "Duration, s")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::cout << Run(options).dump(1) << "\n";
  return 0;
}

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) { return color3d::Main(argc, argv); }
