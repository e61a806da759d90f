// color3d-bench queue: throughput of the real queue with several numbers of worker processes,
// beside what the simulation expects.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/bench/scale/queue_forecast.h"
#include "tests/bench/scale/queue_run.h"
#include "tests/bench/scale/service_times.h"
#include "tests/bench/scale/store_times.h"

namespace color3d {
namespace {

struct QueueArguments {
  std::vector<int> workers = {1, 2, 4, 8};
  QueueRunOptions run;
  bool here = false;
  double least_ratio = 0.0;
  std::string json_file;
};

// Times of the database with the jobs of a run.
ServiceTimes SmallStoreTimes(const std::string& database) {
  StoreLoad load;
  load.database = database;
  load.finished = 0;
  load.claims = 100;
  load.queued = 300;
  load.projects = 1;
  return MeasureStore(load).service;
}

void RunQueueBench(QueueArguments args) {
  args.run.elsewhere = !args.here;
  if (args.workers.empty() || args.workers.front() != 1) {
    throw InvalidArgument("--workers must begin with 1, which the others are compared with");
  }
  const ServiceTimes database = SmallStoreTimes(args.run.database);
  nlohmann::ordered_json json = {{"database", args.run.database},
                                 {"stage_ms", args.run.stage_ms},
                                 {"jobs_per_worker", args.run.jobs_per_worker},
                                 {"workers_elsewhere", args.run.elsewhere},
                                 {"service_ms", TimesToJson(database)}};
  QueueModel model;
  double rate_of_one = 0.0, forecast_of_one = 0.0, ratio = 0.0;
  for (const int workers : args.workers) {
    const QueueRun run = RunQueue(workers, args.run);
    if (rate_of_one == 0.0) {
      model = ModelOfRun(run, args.run, database);
      rate_of_one = run.jobs_per_second;
      forecast_of_one = Forecast(model, 1, args.run).jobs_per_second;
    }
    ratio = run.jobs_per_second / rate_of_one;
    const QueueResult forecast = Forecast(model, workers, args.run);
    const double forecast_ratio = forecast.jobs_per_second / forecast_of_one;
    fmt::print(stderr,
               "{} workers: {:.3f} jobs/s, {:.2f} times one; simulation {:.3f}, {:.2f}; of a core "
               "{:.1f} ms (server) and {:.1f} ms (worker) a job\n",
               workers,
               run.jobs_per_second,
               ratio,
               forecast.jobs_per_second,
               forecast_ratio,
               1e3 * run.server_cpu,
               1e3 * run.worker_cpu);
    json["sizes"].push_back({{"workers", workers},
                             {"jobs", run.jobs},
                             {"seconds", run.seconds},
                             {"jobs_per_second", run.jobs_per_second},
                             {"ratio", ratio},
                             {"seconds_per_job", run.seconds_per_job},
                             {"server_cpu_ms", 1e3 * run.server_cpu},
                             {"worker_cpu_ms", 1e3 * run.worker_cpu},
                             {"simulated_jobs_per_second", forecast.jobs_per_second},
                             {"simulated_ratio", forecast_ratio}});
  }
  json["attempt_ms"] = 1e3 * model.attempt_seconds;
  json["call_cpu_ms"] = 1e3 * model.times.call_cpu;
  WriteResult(json, args.json_file);
  if (ratio < args.least_ratio) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} workers are {:.2f} times one; the least is {}",
                args.workers.back(),
                ratio,
                args.least_ratio);
  }
}

}  // namespace

void AddQueueCommand(CLI::App& app) {
  auto args = std::make_shared<QueueArguments>();
  CLI::App* command = app.add_subcommand(
      "queue", "Throughput of the real queue with worker processes whose stages only wait");
  const auto add = [command](const char* flag, auto& value, const char* text) {
    return command->add_option(flag, value, text)->capture_default_str();
  };
  add("--workers", args->workers, "Numbers of workers, separated by commas; the first is 1")
      ->delimiter(',')
      ->check(CLI::Range(1, 256));
  add("--jobs", args->run.jobs_per_worker, "Jobs for each worker")->check(CLI::Range(2, 190));
  add("--stage-ms", args->run.stage_ms, "Time of a stage, ms")->check(CLI::Range(1, 600'000));
  add("--database", args->run.database, "Kind of store; postgresql: a private server")
      ->check(CLI::IsMember({"sqlite", "postgresql"}));
  command->add_flag("--here",
                    args->here,
                    "Workers that the server starts; else they have folders of their own and reach "
                    "the server by its port");
  add("--limit", args->run.limit_seconds, "Time limit of a number of workers, s")
      ->check(CLI::Range(1, 86'400));
  add("--min-ratio", args->least_ratio, "Fail if the last number of workers is less times one");
  command->add_option("--json", args->json_file, "File for the result; default: standard output");
  command->callback([args] { RunQueueBench(*args); });
}

}  // namespace color3d
