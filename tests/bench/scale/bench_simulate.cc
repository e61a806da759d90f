// color3d-bench simulate: the queue with measured times at several numbers of workers, and what
// limits it first. Deterministic for a seed.
#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/bench/scale/planned_scene.h"
#include "tests/bench/scale/queue_simulation.h"
#include "tests/bench/scale/service_times.h"

namespace color3d {
namespace {

struct SimulateArguments {
  std::vector<int> workers = {1, 8, 64, 256, 1000};
  std::vector<int> photos = {14, 20, 33, 50};
  double photo_mb = 3.0;
  bool estimates_poses = false;
  std::string database = "sqlite";
  std::string times_file;
  double sync_ms = 1.0;
  int servers = 1;
  int cores = 2;
  double link_mbit = 1000.0;
  double blob_mb = 500.0;
  double cache_gib = 20.0;
  QueueModel model;
  std::string json_file;
  std::string csv_file;
};

QueueModel ModelOf(const SimulateArguments& args) {
  QueueModel model = args.model;
  for (const int photos : args.photos) {
    model.kinds.push_back(
        PlannedScene({photos, args.photo_mb * 1e6, /*has_poses=*/!args.estimates_poses}));
  }
  model.times = TimesOfDatabase(args.database);
  if (!args.times_file.empty()) model.times = ReadTimes(args.times_file, model.times);
  ServiceTimes& times = model.times;
  for (double* write :
       {&times.claim_write, &times.join_write, &times.publish_write, &times.checkpoint_write}) {
    *write += 1e-3 * args.sync_ms;
  }
  model.readers *= args.servers;
  model.cores = args.cores * args.servers;
  model.link_bytes_per_second = args.link_mbit * 1e6 / 8.0 * args.servers;
  model.blob_bytes_per_second = args.blob_mb * 1e6;
  model.cache_bytes = static_cast<int64_t>(args.cache_gib * (1 << 30));
  return model;
}

nlohmann::ordered_json ToJson(const QueueResult& result) {
  nlohmann::ordered_json uses;
  for (const ResourceUse& use : result.uses) {
    uses[use.name] = {{"share", use.share}, {"lost", use.lost}};
  }
  return {{"workers", result.workers},
          {"scenes_per_hour", result.scenes_per_hour},
          {"jobs_per_second", result.jobs_per_second},
          {"makespan_s", result.makespan},
          {"finished_scenes", result.finished_scenes},
          {"failed_scenes", result.failed_scenes},
          {"attempts", result.attempts},
          {"losses", result.losses},
          {"preemptions", result.preemptions},
          {"wait_p50_s", result.wait_p50},
          {"wait_p99_s", result.wait_p99},
          {"fetched_bytes", result.fetched_bytes},
          {"stored_bytes", result.stored_bytes},
          {"uses", uses},
          {"bottleneck", result.bottleneck},
          {"next_bottleneck", result.next_bottleneck},
          {"most_workers", result.most_workers},
          {"events", result.events}};
}

std::string CsvOf(const std::vector<QueueResult>& results, const SimulateArguments& args) {
  std::string csv =
      "database,servers,seed,scenes,load,workers,scenes_per_hour,makespan_s,wait_p50_s,wait_p99_s";
  for (const ResourceUse& use : results.front().uses) csv += "," + use.name;
  csv += ",bottleneck,next_bottleneck,most_workers,losses,preemptions,failed_scenes\n";
  for (const QueueResult& result : results) {
    csv += fmt::format("{},{},{},{},{},{},{:.1f},{:.0f},{:.3f},{:.3f}",
                       args.database,
                       args.servers,
                       args.model.seed,
                       args.model.scenes,
                       args.model.load,
                       result.workers,
                       result.scenes_per_hour,
                       result.makespan,
                       result.wait_p50,
                       result.wait_p99);
    for (const ResourceUse& use : result.uses) csv += fmt::format(",{:.4f}", use.share);
    csv += fmt::format(",{},{},{:.0f},{},{},{}\n",
                       result.bottleneck,
                       result.next_bottleneck,
                       result.most_workers,
                       result.losses,
                       result.preemptions,
                       result.failed_scenes);
  }
  return csv;
}

// To standard error, so that standard output stays JSON.
void PrintRow(const QueueResult& result, double seconds) {
  std::string uses;
  for (const ResourceUse& use : result.uses) {
    uses += fmt::format("{} {:.0f} %, ", use.name, 100.0 * use.share);
  }
  fmt::print(
      stderr,
      "{} workers: {:.0f} scenes/h, wait p50 {:.2f} s, p99 {:.2f} s; {}limit: {}; next: {}, at "
      "{:.0f} busy workers ({:.1f} s)\n",
      result.workers,
      result.scenes_per_hour,
      result.wait_p50,
      result.wait_p99,
      uses,
      result.bottleneck,
      result.next_bottleneck,
      result.most_workers,
      seconds);
}

void RunSimulate(const SimulateArguments& args) {
  const QueueModel model = ModelOf(args);
  fmt::print(stderr, "seed {}\n", model.seed);
  nlohmann::ordered_json json = {{"seed", model.seed},
                                 {"database", args.database},
                                 {"servers", args.servers},
                                 {"scenes", model.scenes},
                                 {"load", model.load},
                                 {"service_ms", TimesToJson(model.times)}};
  double seconds = 0.0;
  for (const SimulatedScene& scene : model.kinds) {
    for (const SimulatedStage& stage : scene.stages) seconds += stage.seconds;
  }
  json["mean_scene_s"] = seconds / static_cast<double>(model.kinds.size());
  json["stages"] = model.kinds.front().stages.size();
  std::vector<QueueResult> results;
  for (const int workers : args.workers) {
    QueueModel sized = model;
    sized.workers = workers;
    const auto begun = std::chrono::steady_clock::now();
    results.push_back(SimulateQueue(sized));
    PrintRow(results.back(),
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    json["sizes"].push_back(ToJson(results.back()));
  }
  WriteResult(json, args.json_file);
  if (!args.csv_file.empty()) WriteFileAtomic(args.csv_file, CsvOf(results, args));
}

}  // namespace

void AddSimulateCommand(CLI::App& app) {
  auto args = std::make_shared<SimulateArguments>();
  QueueModel& model = args->model;
  model.scenes = 100'000;
  model.spread = 0.25;
  model.losses_per_hour = 0.01;
  model.preemptions_per_hour = 0.1;
  CLI::App* command = app.add_subcommand(
      "simulate", "Simulate the queue at several numbers of workers and name what limits it first");
  const auto add = [command](const char* flag, auto& value, const char* text) {
    return command->add_option(flag, value, text)->capture_default_str();
  };
  add("--workers", args->workers, "Numbers of workers, separated by commas")
      ->delimiter(',')
      ->check(CLI::Range(1, 1'000'000));
  add("--scenes", model.scenes, "Number of scenes")
      ->check(CLI::Range(int64_t{1}, int64_t{10'000'000}));
  add("--seed", model.seed, "Seed of times, arrivals and failures");
  add("--load", model.load, "Submitted work over the workers' capacity; 0: all scenes at once")
      ->check(CLI::Range(0.0, 10.0));
  add("--photos", args->photos, "Numbers of photos of the scenes, drawn with equal probability")
      ->delimiter(',')
      ->check(CLI::Range(2, 100'000));
  add("--photo-mb", args->photo_mb, "Size of a photo, MB")->check(CLI::Range(0.0, 10'000.0));
  command->add_flag("--estimate-poses", args->estimates_poses, "The photos come without poses");
  add("--spread", model.spread, "Standard deviation of a stage's seconds over their mean")
      ->check(CLI::Range(0.0, 10.0));
  add("--database", args->database, "Times of the job store: sqlite measured, postgresql assumed")
      ->check(CLI::IsMember({"sqlite", "postgresql"}));
  command
      ->add_option("--times", args->times_file, "Result of color3d-bench store, in place of them")
      ->check(CLI::ExistingFile);
  add("--sync-ms",
      args->sync_ms,
      "Time of the database's disk to sync a write, added to the times, ms; 0 if they have it")
      ->check(CLI::Range(0.0, 1e4));
  add("--servers", args->servers, "Number of servers")->check(CLI::Range(1, 1000));
  add("--cores", args->cores, "Cores of each server")->check(CLI::Range(1, 1024));
  add("--link-mbit", args->link_mbit, "Network of each server, Mbit/s")
      ->check(CLI::Range(1.0, 1e7));
  add("--blob-mb", args->blob_mb, "Rate of the folder or store of blobs, MB/s")
      ->check(CLI::Range(1.0, 1e7));
  add("--cache-gib", args->cache_gib, "Cache of each worker, GiB; 0: none")
      ->check(CLI::Range(0.0, 1e6));
  add("--progress", model.progress, "Pause between heartbeats of a stage with progress, s; 0: none")
      ->check(CLI::Range(0.0, 3600.0));
  add("--preference", model.preference, "Wait for the worker that has a job's blobs, s; 0: none")
      ->check(CLI::Range(0.0, 3600.0));
  add("--lease", model.lease, "Lease of a job, s")->check(CLI::Range(0.0, 1e6));
  add("--losses", model.losses_per_hour, "Losses of a worker an hour")
      ->check(CLI::Range(0.0, 3600.0));
  add("--preemptions", model.preemptions_per_hour, "Preemptions of a worker an hour")
      ->check(CLI::Range(0.0, 3600.0));
  command->add_option("--json", args->json_file, "File for the result; default: standard output");
  command->add_option("--csv", args->csv_file, "File for a table of the result");
  command->callback([args] { RunSimulate(*args); });
}

}  // namespace color3d
