// color3d-server: `serve` answers RPCs and supervises workers; `token`, `backup`, `restore`,
// `fsck` and `migrate` are for operators; `worker` executes color3d-worker, the program beside this
// one that links the method library.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>

#include "core/base/error.h"
#include "server/access/tokens.h"
#include "server/blob_place.h"
#include "server/keeping/backup.h"
#include "server/keeping/fsck.h"
#include "server/ops/process.h"
#include "server/serve.h"
#include "server/store/postgresql/copy_store.h"

namespace color3d {
namespace {

void AddBlobPlace(CLI::App* command, BlobPlaceOptions* options) {
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
void AddServe(CLI::App* serve, ServeOptions* options) {
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
  AddBlobPlace(serve, &options->blobs);
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

// Flags override the environment.
void TakeFromEnvironment(const char* variable, std::vector<std::string>* values) {
  const char* text = std::getenv(variable);
  if (text == nullptr || !values->empty()) return;
  std::istringstream stream(text);
  for (std::string value; std::getline(stream, value, ';');) {
    if (!value.empty()) values->push_back(value);
  }
}

struct KeepingArguments {
  std::filesystem::path data_folder, copy;
  std::string address;  // of a PostgreSQL store
  BlobPlaceOptions blobs;
  bool repair = false;
  std::function<int()> run;  // empty: another command
};

// Returns exit status 1 if the copy lacks blobs, which are listed.
int ReportMissingBlobs(const CopiedBlobs& copied, const std::filesystem::path& from) {
  if (!copied.elsewhere.empty()) {
    std::cout << fmt::format(
        "its blobs are in {} and were not copied: keep versions or a replica of that bucket\n",
        copied.elsewhere);
  }
  for (const std::string& sha256 : copied.missing) std::cout << "missing: " << sha256 << "\n";
  for (const std::string& sha256 : copied.damaged) std::cout << "damaged: " << sha256 << "\n";
  for (const std::string& what : copied.unreadable) std::cout << "unreadable: " << what << "\n";
  if (copied.awaited > 0) {
    std::cout << fmt::format("{} files of uncommitted scenes were not uploaded yet\n",
                             copied.awaited);
  }
  if (copied.IsWhole()) return 0;
  if (!copied.unreadable.empty()) {
    std::cout
        << "change the owner or permissions of the unreadable files, or check the disk, and copy "
           "again\n";
  }
  if (copied.missing.empty() && copied.damaged.empty()) return 1;
  std::cout << fmt::format(
      "{} blobs of {} are missing and {} damaged, and left out of the copy: upload the files of "
      "their scenes again, or run their jobs again with skip_cache\n",
      copied.missing.size(),
      from.string(),
      copied.damaged.size());
  return 1;
}

int RunBackUp(const KeepingArguments& arguments) {
  const CopiedBlobs copied = BackUp(arguments.data_folder, arguments.copy);
  std::cout << fmt::format(
      "{}: {} blobs copied ({} MiB), {} kept{}\n",
      arguments.copy.string(),
      copied.copied,
      copied.bytes >> 20,
      copied.kept,
      copied.mended > 0 ? fmt::format("; {} damaged ones replaced", copied.mended) : "");
  return ReportMissingBlobs(copied, arguments.data_folder);
}

int RunRestore(const KeepingArguments& arguments) {
  const CopiedBlobs copied = Restore(arguments.copy, arguments.data_folder);
  std::cout << fmt::format("{}: {} blobs restored and verified; start color3d-server serve on it\n",
                           arguments.data_folder.string(),
                           copied.copied);
  return ReportMissingBlobs(copied, arguments.copy);
}

int RunFsck(const KeepingArguments& arguments) {
  const bool is_terminal = ::isatty(2) == 1;
  const auto progress = [&](int64_t blobs) {
    if (is_terminal && blobs % 100 == 0) std::cerr << "\r" << blobs << " blobs" << std::flush;
  };
  const std::unique_ptr<BlobStore> elsewhere =
      OpenBlobsAsTool(arguments.blobs, DataPaths(arguments.data_folder));
  const FsckResult result =
      Fsck(arguments.data_folder, arguments.address, elsewhere.get(), arguments.repair, progress);
  if (is_terminal) std::cerr << "\r";
  for (const std::string& problem : result.store_problems)
    std::cout << "jobs.db: " << problem << "\n";
  for (const std::string& sha256 : result.missing) std::cout << "missing: " << sha256 << "\n";
  for (const std::string& sha256 : result.damaged) std::cout << "damaged: " << sha256 << "\n";
  for (const std::string& what : result.unreadable) std::cout << "unreadable: " << what << "\n";
  std::cout << fmt::format(
      "{} blobs ({} MiB), {} unreferenced; {} missing, {} damaged, {} damaged and unreferenced, "
      "{} unreadable; {} of uncommitted scenes not uploaded yet\n",
      result.blobs,
      result.bytes >> 20,
      result.unnamed,
      result.missing.size(),
      result.damaged.size(),
      result.damaged_unnamed,
      result.unreadable.size(),
      result.awaited);
  if (!result.store_problems.empty()) {
    std::cout << "restore jobs.db from a backup (color3d-server restore)\n";
  } else if (result.missing.empty() && result.damaged.empty() && !result.unreadable.empty()) {
    std::cout << "change the owner or permissions of the unreadable files, or check the disk\n";
  } else if (!result.IsGood()) {
    std::cout << (arguments.repair ? "damaged blobs are set aside: "
                                   : "use --repair to set damaged blobs aside, then ")
              << "upload the files of the scene again, or run the jobs again with skip_cache\n";
  }
  return result.IsGood() ? 0 : 1;
}

int RunMigrate(const KeepingArguments& arguments) {
  const bool is_terminal = ::isatty(2) == 1;
  const CopiedStore copied =
      CopyToPostgresql(arguments.data_folder / "jobs.db",
                       arguments.address,
                       [&](const std::string& table, int64_t rows) {
                         if (is_terminal)
                           std::cerr << fmt::format("\r{}: {} rows   ", table, rows) << std::flush;
                       });
  if (is_terminal) std::cerr << "\r";
  std::cout << fmt::format(
      "{} scenes, {} jobs and {} events copied and verified; start color3d-server serve --store on "
      "it with the same blobs\n",
      copied.rows.at("scene"),
      copied.rows.at("job"),
      copied.rows.at("job_event"));
  return 0;
}

void AddKeeping(CLI::App* app, KeepingArguments* arguments) {
  const auto add = [&](const char* name, const char* what, int (*run)(const KeepingArguments&)) {
    CLI::App* command = app->add_subcommand(name, what);
    command->add_option("--data-dir", arguments->data_folder, "Data folder of the server")
        ->required();
    command->callback([arguments, run] { arguments->run = [=] { return run(*arguments); }; });
    return command;
  };
  add("backup", "Back up the store and all referenced files; the server may run", RunBackUp)
      ->add_option("FOLDER", arguments->copy, "Empty folder, or an earlier backup")
      ->required();
  add("restore", "Restore a backup to a new data folder", RunRestore)
      ->add_option("FOLDER", arguments->copy, "Folder of the backup")
      ->required();
  CLI::App* fsck = add("fsck", "Check a data folder; no server may use it", RunFsck);
  fsck->add_flag("--repair", arguments->repair, "Set damaged blobs aside");
  fsck->add_option("--store", arguments->address, "As for serve, if jobs are in PostgreSQL");
  AddBlobPlace(fsck, &arguments->blobs);
  add("migrate", "Copy the jobs of a data folder to PostgreSQL; the server may run", RunMigrate)
      ->add_option("--to",
                   arguments->address,
                   "postgresql://ROLE@HOST:PORT/DATABASE: empty, or a copy that no server has used")
      ->required();
}

// Replaces this process with color3d-worker and the arguments after "worker".
int ExecWorker(char** argv) {
  const std::string program = (ProgramFolder() / "color3d-worker").string();
  argv[1] = const_cast<char*>(program.c_str());
  ::execv(program.c_str(), argv + 1);
  std::cerr << "color3d-server: cannot start " << program << ": " << std::strerror(errno)
            << "; install color3d-worker beside color3d-server\n";
  return 2;
}

int Main(int argc, char** argv) {
  // Inherited by workers. Threads that spin while waiting slow down a busy machine.
  ::setenv("OMP_WAIT_POLICY", "PASSIVE", /*overwrite=*/0);
  if (argc > 1 && std::string(argv[1]) == "worker") return ExecWorker(argv);
  ServeOptions options;
  CLI::App app("Color3D server: colours 3D scenes from monochrome photographs.");
  app.set_version_flag("--version", COLOR3D_VERSION);
  CLI::App* serve = app.add_subcommand("serve", "Answer RPCs and run jobs");
  app.add_subcommand("worker", "Run jobs of a server (see worker --help)");
  std::string token_name, token_role = "submit";
  std::string token_project;
  std::filesystem::path token_file;
  CLI::App* token = app.add_subcommand("token", "Create a token for a caller and print it once");
  token->add_option("NAME", token_name, "Name of the caller, for logs")->required();
  token
      ->add_option(
          "--role",
          token_role,
          "read, submit or admin, each with the ones before; or worker, for color3d-worker "
          "--server")
      ->capture_default_str();
  token->add_option("--project",
                    token_project,
                    "Project; the token gives access to its scenes, jobs and files only");
  token->add_option("--tokens", token_file, "File of serve --tokens")->required();
  KeepingArguments keeping;
  AddKeeping(&app, &keeping);
  app.require_subcommand(1);
  AddServe(serve, &options);
  CLI11_PARSE(app, argc, argv);
  TakeFromEnvironment("COLOR3D_MODELS", &options.models);
  TakeFromEnvironment("COLOR3D_BACKENDS", &options.backends);
  // The server's own messages are clearer than the log of gRPC.
  ::setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  try {
    if (keeping.run) return keeping.run();
    if (token->parsed()) {
      std::error_code error;
      const bool is_fresh = !std::filesystem::exists(token_file, error);
      std::cout << AddToken(token_file, token_name, RoleFromName(token_role), token_project)
                << "\n";
      if (is_fresh && ::geteuid() == 0) {
        std::cerr << "color3d-server: note: " << token_file.string()
                  << " is new and root's alone; let the service's user read it (chown)\n";
      }
      return 0;
    }
    Serve(options);
    return 0;
  } catch (const Error& e) {
    std::cerr << "color3d-server: " << e.what() << "\n";
    return e.code() == ErrorCode::kUnavailable ? 1 : 2;  // 1: a retry may succeed
  } catch (const std::exception& e) {
    std::cerr << "color3d-server: unexpected: " << e.what() << "\n";
    return 1;
  }
}

}  // namespace
}  // namespace color3d

int main(int argc, char** argv) { return color3d::Main(argc, argv); }
