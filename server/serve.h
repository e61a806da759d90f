// `color3d-server serve`: wires stores, RPC server, maintenance and workers together, and drains
// them on SIGTERM.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/worker/supervision/worker_settings.h"

namespace color3d {

struct ServeOptions {
  std::string listen = "127.0.0.1:50551";
  bool insecure_any_address = false;
  // PEM files; a certificate and its key: TLS. A client CA: clients must show a certificate, too.
  std::filesystem::path tls_certificate, tls_key, tls_client_ca;
  std::filesystem::path tokens;  // empty: no call needs one
  // File with the roles of the certificates of tls_client_ca; empty: tokens are needed.
  std::filesystem::path certificate_roles;
  int max_connections = 4096;
  std::filesystem::path data_folder;
  std::filesystem::path port_file;  // empty: none
  int workers = 1;
  // Passed on to the workers. `serve` sets the folder, threads, memory and grace of each itself.
  WorkerSettings worker;
  int threads = 0;  // of each worker; 0: the machine's, shared among the workers
  // Threads of the inference worker; 0: the machine's.
  int live_threads = 0;
  // Memory of each worker, MiB; 0: three quarters of the machine's, shared among the workers, and
  // half of the machine's for the inference worker.
  int64_t worker_memory_mib = 0;
  double drain_seconds = 20.0;
  int64_t low_space_mib =
      512;  // free; below it no job is begun; 0: jobs are begun until it is full
  int max_unfinished_jobs = 2'000;
  // Limits of each project; 0: none of its own.
  int project_jobs = 0, project_streams = 0;
  double project_gib = 0.0;
  int project_scenes = 10'000;
  int keep_uncommitted_days = 7;          // of scenes that were never committed; 0: for ever
  int keep_days = 0;                      // of jobs after their end, unless pinned; 0: for ever
  std::string metrics_listen;             // HOST:PORT for Prometheus; empty: none
  std::filesystem::path notify_secret;    // file; needed with the next
  std::vector<std::string> notify_allow;  // addresses that may be told of ended jobs
  std::vector<std::string> models;        // "NAME=FILE"
  std::vector<std::string> backends;      // "NAME=ADDRESS"
  // For tests.
  std::filesystem::path worker_program;  // empty: color3d-worker beside this program
  int max_attempts = 3;
  double probe_seconds = 10.0;  // between two looks whether the server answers
  int64_t worker_backoff_ms = 10'000;
};

// Returns after a drain. Throws Error for faults that the user can mend (exit status 2), and
// Error{kUnavailable} if the server no longer answered calls (exit status 1).
void Serve(const ServeOptions& options);

}  // namespace color3d
