// `color3d-server serve`: connects stores, RPC server, maintenance and workers, and drains them on
// SIGTERM.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/blob_place.h"
#include "server/worker/supervision/worker_settings.h"

namespace color3d {

struct ServeOptions {
  std::string listen = "127.0.0.1:50551";
  bool insecure_any_address = false;
  // PEM files. TLS requires certificate and key; with a client CA, clients must present a
  // certificate.
  std::filesystem::path tls_certificate, tls_key, tls_client_ca;
  std::filesystem::path tokens;  // empty: calls need no token
  // Roles of the certificates of tls_client_ca; empty: tokens are required.
  std::filesystem::path certificate_roles;
  int max_connections = 4096;
  std::filesystem::path data_folder;
  // postgresql://..., shared with other servers; empty: jobs.db in the data folder.
  std::string store;
  BlobPlaceOptions blobs;           // reserve_mib: that of the workers
  std::filesystem::path port_file;  // empty: none
  int workers = 1;
  // Passed to the workers, except for folder, threads, memory and grace, which `serve` sets.
  WorkerSettings worker;
  int threads = 0;  // per worker; 0: the cores of the machine, divided by the workers
  // Threads of the inference worker; 0: the cores of the machine.
  int live_threads = 0;
  // Memory per worker, MiB; 0: three quarters of the machine's memory divided by the workers, and
  // half of it for the inference worker.
  int64_t worker_memory_mib = 0;
  double drain_seconds = 20.0;
  double idle_exit_seconds = 0.0;  // ends after this time without use; 0: never
  int64_t low_space_mib = 512;     // no job starts below this free space; 0: no limit
  int max_unfinished_jobs = 2'000;
  // Limits of each project; 0: none.
  int project_jobs = 0, project_streams = 0;
  double project_gib = 0.0;
  int project_scenes = 10'000;
  int keep_uncommitted_days = 7;          // uncommitted scenes; 0: forever
  int keep_days = 0;                      // finished jobs, unless pinned; 0: forever
  std::string metrics_listen;             // HOST:PORT for Prometheus; empty: none
  std::filesystem::path notify_secret;    // file; required by notify_allow
  std::vector<std::string> notify_allow;  // allowed addresses of notifications
  std::vector<std::string> models;        // "NAME=FILE"
  std::vector<std::string> backends;      // "NAME=ADDRESS"
  // Program that asks an engine for workers; empty: none. See scale_command.h.
  std::filesystem::path scale_command;
  int scale_max = 8;
  double scale_seconds = 30.0;
  // For tests.
  std::filesystem::path worker_program;  // empty: color3d-worker beside this program
  int max_attempts = 3;
  double probe_seconds = 10.0;  // between two probes of the own server
  int64_t worker_backoff_ms = 10'000;
};

// Returns after a drain. Throws Error for faults that the user can fix (exit status 2), and
// Error{kUnavailable} if the server stopped answering calls (exit status 1).
void Serve(const ServeOptions& options);

}  // namespace color3d
