// Parameters and results of the simulated queue (queue_simulation.h). Plain values. Times in
// seconds, sizes in bytes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace color3d {

// One job of a scene.
struct SimulatedStage {
  std::string kind;
  double seconds = 0.0;     // of computing, mean
  std::vector<int> inputs;  // positions of earlier stages, whose results it reads
  int64_t output_bytes = 0;
  int output_files = 0;
  int64_t checkpoint_bytes = 0;
  bool resumes = false;  // goes on from its last checkpoint after its worker is lost
};

struct SimulatedScene {
  std::vector<SimulatedStage> stages;  // the last one ends the scene
  int64_t bytes = 0;                   // of its files, which every stage reads
  int files = 0;
};

// Work of the server and of the database for the calls of a worker, measured by `color3d-bench
// store` and `color3d-bench queue`.
struct ServiceTimes {
  // Of a reading connection.
  double claim_read = 0.0;    // to find the next job, or that there is none
  double prepare_read = 0.0;  // scene, inputs, graph and stage cache of one attempt, in sum
  // Of the writer, which transactions take in turns.
  double claim_write = 0.0;
  double join_write = 0.0;
  double publish_write = 0.0;
  double artifact_write = 0.0;  // each result, in the transaction of the publication
  double heartbeat_write = 0.0;
  double worker_write = 0.0;  // state of the worker: twice an attempt and at heartbeats
  double checkpoint_write = 0.0;
  // Of a core of the server.
  double call_cpu = 0.0;
  double byte_cpu = 0.0;  // sending or receiving one byte of a blob
};

struct QueueModel {
  int workers = 1;
  int64_t scenes = 1;
  uint64_t seed = 1;
  std::vector<SimulatedScene> kinds;  // of scenes, drawn with equal probability
  double spread = 0.0;                // standard deviation of a stage's time over its mean
  // Submitted work over the capacity of the workers, as a Poisson process; 0: all scenes are
  // submitted at the beginning.
  double load = 0.0;

  ServiceTimes times;
  int writers = 1;                     // transactions that write at a time; 0: any number
  int readers = 4;                     // connections that read; 0: any number
  int cores = 2;                       // of all servers; 0: any number
  double link_bytes_per_second = 0.0;  // of all servers; 0: not limited
  double blob_bytes_per_second = 0.0;  // of the folder or store of blobs; 0: not limited
  int64_t cache_bytes = 0;             // of each worker

  double attempt_seconds = 0.0;  // the worker's own work for an attempt beside the stage
  double local_cpu = 0.0;        // of an attempt on the server's cores, for workers beside it
  double poll = 1.0;             // pause of a worker without work
  double progress = 0.25;        // pause between heartbeats of a stage that makes progress; 0: none
  double heartbeat = 10.0;       // pause between reports of the worker's state
  double lease = 60.0;
  double checkpoint = 20.0;  // least time between checkpoints
  double preference = 3.0;   // while a job waits for the worker that has its blobs; 0: for none
  double retry_pause = 2.0;  // before the first repetition; doubles
  int most_losses = 3;       // a job that loses its worker so often fails

  // Of one worker. It starts again after `restart`, with an empty cache.
  double losses_per_hour = 0.0;       // ends without a word: its lease expires
  double preemptions_per_hour = 0.0;  // ends after releasing its job
  double restart = 60.0;
};

struct ResourceUse {
  std::string name;
  double share = 0.0;  // of its capacity until the last scene has ended
  double lost = 0.0;   // share of the workers' time that passed in waiting for it
};

struct QueueResult {
  int workers = 0;
  int64_t finished_scenes = 0;
  int64_t failed_scenes = 0;
  int64_t attempts = 0;
  int64_t losses = 0;  // attempts that ended with their worker
  int64_t preemptions = 0;
  double makespan = 0.0;
  double scenes_per_hour = 0.0;
  double jobs_per_second = 0.0;
  double wait_p50 = 0.0;  // from queued to claimed
  double wait_p99 = 0.0;
  int64_t fetched_bytes = 0;
  int64_t stored_bytes = 0;
  int64_t events = 0;
  std::vector<ResourceUse> uses;  // the workers first
  // The resource that the workers lose most time to, or "workers" if they lose less than 5 % to
  // all.
  std::string bottleneck;
  // Number of busy workers at which the most used resource of the servers would be full, from its
  // present share without heartbeats, which become fewer then; and the resource.
  double most_workers = 0.0;
  std::string next_bottleneck;
};

// Throws Error{kInvalidArgument} for a model without workers, scenes or stages, with negative
// times, or with inputs that are not earlier stages.
void CheckModel(const QueueModel& model);

}  // namespace color3d
