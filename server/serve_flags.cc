#include "server/serve_flags.h"

#include <cstdlib>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace color3d {
namespace {

// `variable`: values separated by ';'.
void TakeFromEnvironment(const char* variable, std::vector<std::string>* values) {
  const char* text = std::getenv(variable);
  if (text == nullptr || !values->empty()) return;
  std::istringstream stream(text);
  for (std::string value; std::getline(stream, value, ';');) {
    if (!value.empty()) values->push_back(value);
  }
}

}  // namespace

void AddBlobPlaceFlags(CLI::App* command, BlobPlaceOptions* options) {
  command->add_option("--blobs",
                      options->blobs,
                      "s3://BUCKET[/PREFIX]: keep files in an object store, which several servers "
                      "may share; default: the data folder");
  command->add_option("--s3-endpoint",
                      options->endpoint,
                      "Address of the object store: https://HOST[:PORT], or http://HOST[:PORT] in "
                      "a trusted network; default: Amazon's of the region");
  command->add_option("--s3-region", options->region, "Region of the bucket")
      ->capture_default_str();
  command->add_option("--s3-credentials-file",
                      options->credentials,
                      "File with lines access_key_id = ID and secret_access_key = SECRET, and "
                      "session_token = TOKEN of temporary keys; reloaded after changes");
  command->add_option("--s3-ca",
                      options->authorities,
                      "PEM file with the authorities of the object store's certificate; default: "
                      "those of the system");
  command
      ->add_option("--blob-cache-gib",
                   options->cache_gib,
                   "Size of the files of the object store that are kept on this machine, GiB: half "
                   "by the server, half by its workers")
      ->check(CLI::Range(0.01, 1e6))
      ->capture_default_str();
}

// Flags of the group "" are hidden, for tests.
void AddServeFlags(CLI::App* serve, ServeOptions* options) {
  serve
      ->add_option(
          "--listen", options->listen, "Address: HOST:PORT (port 0: any free port) or unix:PATH")
      ->capture_default_str();
  serve->add_option("--data-dir", options->data_folder, "Data folder with jobs and files")
      ->required();
  serve->add_option("--store",
                    options->store,
                    "postgresql://ROLE@HOST:PORT/DATABASE with the jobs, which several servers may "
                    "share; default: jobs.db in the data folder");
  AddBlobPlaceFlags(serve, &options->blobs);
  serve
      ->add_option(
          "--workers", options->workers, "Number of worker processes; each runs one job at a time")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  serve
      ->add_option(
          "--threads", options->threads, "Threads per worker; 0: the cores divided by the workers")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  serve
      ->add_option("--live-threads",
                   options->live_threads,
                   "Threads of the inference worker, which answers ColorizeImages; 0: all cores")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  serve
      ->add_option(
          "--worker-memory-mib",
          options->worker_memory_mib,
          "Memory limit of each worker, and of COLMAP beside it, MiB; jobs that need more fail. "
          "0: three quarters of the memory of the machine or container, divided by the "
          "workers, and half of it for the inference worker")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 30))
      ->capture_default_str();
  serve->add_option("--port-file", options->port_file, "File to write the bound address to");
  serve
      ->add_option("--log-level", options->worker.log_level, "trace, debug, info, warn, error, off")
      ->capture_default_str();
  serve
      ->add_option(
          "--log-format", options->worker.log_format, "text, or json with one object per line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  serve->add_option("--metrics-listen",
                    options->metrics_listen,
                    "HOST:PORT of the metrics for Prometheus (/metrics)");
  serve->add_option("--otlp-endpoint",
                    options->worker.otlp_endpoint,
                    "http[s]://HOST:PORT of a collector of OpenTelemetry that receives traces "
                    "(OTLP over HTTP). Default: OTEL_EXPORTER_OTLP_ENDPOINT");
  serve->add_flag("!--no-sandbox",
                  options->worker.sandbox,
                  "Run workers, COLMAP and scripts without a sandbox");
  serve->add_flag("--insecure-any-address",
                  options->insecure_any_address,
                  "Allow --listen on addresses beyond loopback without TLS and tokens");
  serve->add_option(
      "--tls-cert", options->tls_certificate, "PEM file with the certificate of the server");
  serve->add_option("--tls-key", options->tls_key, "PEM file with the key of the certificate");
  serve->add_option(
      "--tls-client-ca",
      options->tls_client_ca,
      "PEM file of authorities; clients must present a certificate signed by one of them");
  serve->add_option(
      "--certificate-roles",
      options->certificate_roles,
      "File with the roles of client certificates: lines NAME ROLE [PROJECT], '*' for any "
      "name; reloaded after changes");
  serve
      ->add_option("--max-connections",
                   options->max_connections,
                   "Maximum number of connections; fewer if the limit of open files is lower")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  serve->add_option(
      "--tokens",
      options->tokens,
      "File with the tokens of callers, written by `color3d-server token`; reloaded after "
      "changes");
  serve
      ->add_option(
          "--model",
          options->models,
          "NAME=FILE: weights for jobs (DDColor, ConvNeXt, CLIP, TorchScript); repeatable. "
          "Default: COLOR3D_MODELS, separated by ';'")
      ->allow_extra_args(false);
  serve
      ->add_option(
          "--backend",
          options->backends,
          "NAME=ADDRESS: a ColorBackend server: HOST:PORT or unix:PATH on this machine, "
          "https://HOST:PORT, or http://HOST:PORT in a trusted network; repeatable. Default: "
          "COLOR3D_BACKENDS, separated by ';'")
      ->allow_extra_args(false);
  serve->add_option("--reserve-mib", options->worker.reserve_mib, "Disk space to keep free, MiB")
      ->check(CLI::Range(0, 1 << 30))
      ->capture_default_str();
  serve
      ->add_option("--max-unfinished-jobs",
                   options->max_unfinished_jobs,
                   "Maximum number of unfinished jobs")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  serve
      ->add_option("--low-space-mib",
                   options->low_space_mib,
                   "Free disk space below which no job is accepted or started, MiB")
      ->check(CLI::Range(0, 1 << 30))
      ->capture_default_str();
  serve
      ->add_option("--project-jobs",
                   options->project_jobs,
                   "Maximum number of unfinished jobs per project; 0: no limit")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  serve
      ->add_option("--project-gib",
                   options->project_gib,
                   "Maximum storage per project, files and database rows, GiB; 0: no limit")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  serve
      ->add_option(
          "--project-scenes", options->project_scenes, "Maximum number of scenes per project")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str();
  serve
      ->add_option("--keep-uncommitted-days",
                   options->keep_uncommitted_days,
                   "Delete uncommitted scenes after this time; 0: never")
      ->check(CLI::Range(0, 36'500))
      ->capture_default_str();
  serve
      ->add_option(
          "--project-streams",
          options->project_streams,
          "Maximum number per project of watches, of uploads, of downloads and of live streams; 0: "
          "no limit")
      ->check(CLI::Range(0, 10'000))
      ->capture_default_str();
  serve
      ->add_option(
          "--keep-days",
          options->keep_days,
          "Delete jobs this long after their end, unless pinned, and scenes without jobs; 0: "
          "never")
      ->check(CLI::Range(0, 36'500))
      ->capture_default_str();
  serve
      ->add_option(
          "--notify-allow",
          options->notify_allow,
          "http[s]://HOST[:PORT][/PATH]: allowed address for notifications of finished jobs; "
          "repeatable")
      ->allow_extra_args(false);
  serve->add_option("--notify-secret",
                    options->notify_secret,
                    "File with the key that signs notifications: base64 of 24 to 64 bytes");
  CLI::Option* scale =
      serve->add_option("--scale-command",
                        options->scale_command,
                        "Absolute path of a program that asks an engine (Slurm, Kubernetes, ...) "
                        "for workers; run with their number, without a shell");
  serve
      ->add_option("--scale-max",
                   options->scale_max,
                   "Maximum number of workers that --scale-command is told")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str()
      ->needs(scale);
  serve
      ->add_option("--scale-seconds",
                   options->scale_seconds,
                   "Time from the end of --scale-command to its next run, at least")
      ->check(CLI::Range(1.0, 86'400.0))
      ->capture_default_str()
      ->needs(scale);
  serve
      ->add_option("--idle-exit",
                   options->idle_exit_seconds,
                   "End after this time without calls and jobs, e.g. 90s, 30m, 2h; 0: never")
      ->transform(CLI::AsNumberWithUnit(
          std::map<std::string, double>{{"s", 1.0}, {"m", 60.0}, {"h", 3600.0}},
          CLI::AsNumberWithUnit::UNIT_OPTIONAL,
          "TIME"));
  serve->add_option("--drain-seconds", options->drain_seconds, "Maximum time to stop after SIGTERM")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  serve->add_option("--worker-program", options->worker_program)->group("");
  VisitTimings(options->worker, [serve](const char* flag, auto& value) {
    serve->add_option(flag, value)->group("");
  });
  serve->add_option("--max-attempts", options->max_attempts)->group("");
  serve->add_option("--worker-backoff-ms", options->worker_backoff_ms)->group("");
  serve->add_option("--probe-seconds", options->probe_seconds)->group("");
}

void CompleteFromEnvironment(ServeOptions* options) {
  TakeFromEnvironment("COLOR3D_MODELS", &options->models);
  TakeFromEnvironment("COLOR3D_BACKENDS", &options->backends);
}

}  // namespace color3d
