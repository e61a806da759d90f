// Command line, log and signals of a worker process.
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <map>
#include <thread>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/mutex.h"
#include "core/base/process/host_name.h"
#include "core/base/process/process_limits.h"
#include "core/base/process/sandbox.h"
#include "core/trace/tracer.h"
#include "server/ops/process.h"
#include "server/ops/stop_signals.h"
#include "server/storage/data_folder.h"
#include "server/worker/live/inference_worker.h"
#include "server/worker/remote/server_access.h"
#include "server/worker/remote/worker_place.h"
#include "server/worker/supervision/worker_settings.h"
#include "server/worker/worker_loop.h"

namespace color3d {
namespace {

// Twice the largest blob, because derived files may be larger.
constexpr int64_t kMaxFileBytes = int64_t{16} << 30;

constexpr int64_t kMaxMemoryMib = int64_t{1} << 30;

struct WorkerArguments {
  WorkerSettings settings;
  WorkerOptions options;
  std::vector<std::string> models;
  std::vector<std::string> backends;
  std::string inference;  // socket; empty: a worker for jobs
  int max_batch = InferenceOptions().max_batch;
  double idle_seconds = 900.0;
  std::filesystem::path token_file;  // with --server
  std::filesystem::path cache_folder;
  int64_t cache_mib = WorkerOptions().cache_bytes >> 20;
  double idle_exit_seconds = 0.0;
  std::string until;

  bool IsElsewhere() const { return !options.server.address.empty(); }
};

std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<int64_t>(seconds * 1000.0));
}

// For a worker on another machine than its server.
void AddRemoteFlags(CLI::App* app, CLI::Option* data_folder, WorkerArguments* arguments) {
  WorkerTarget& server = arguments->options.server;
  CLI::Option* address =
      app->add_option(
             "--server",
             server.address,
             "Address of a server on another machine: https://HOST:PORT, or HOST:PORT in a "
             "trusted network")
          ->excludes(data_folder);
  const auto add = [&](const char* flag, auto& value, const char* text) {
    return app->add_option(flag, value, text)->needs(address);
  };
  add("--token-file", arguments->token_file, "File with a token of the role worker");
  add("--tls-ca", server.ca, "PEM file with the authorities of the server's certificate");
  add("--tls-cert", server.certificate, "PEM file with the certificate of this worker");
  add("--tls-key", server.key, "PEM file with its key");
  add("--cache-dir",
      arguments->cache_folder,
      "Folder of this worker for cached files, jobs and logs; default: color3d-worker in "
      "$XDG_CACHE_HOME or ~/.cache");
  add("--cache-mib", arguments->cache_mib, "Size of the cached files of scenes and results, MiB")
      ->check(CLI::Range(int64_t{0}, int64_t{1} << 30))
      ->capture_default_str();
  add("--idle-exit",
      arguments->idle_exit_seconds,
      "End after this time without a job, e.g. 90s, 10m, 2h; 0: never")
      ->transform(CLI::AsNumberWithUnit(
          std::map<std::string, double>{{"s", 1.0}, {"m", 60.0}, {"h", 3600.0}},
          CLI::AsNumberWithUnit::UNIT_OPTIONAL,
          "TIME"));
  add("--until",
      arguments->until,
      "Release the job and end before this time: RFC 3339, e.g. 2026-01-31T18:00:00Z, or seconds "
      "from now");
}

// Flags without a group are hidden: set by `serve` and by tests.
void AddFlags(CLI::App* app, WorkerArguments* arguments) {
  WorkerSettings& settings = arguments->settings;
  WorkerOptions& options = arguments->options;
  CLI::Option* folder = app->add_option(
      "--data-dir", settings.data_folder, "Data directory of a server on this machine");
  AddRemoteFlags(app, folder, arguments);
  app->add_option(
      "--name", options.name, "Name in logs and in GetServerInfo; default: worker-1, or the host");
  app->add_option("--threads", settings.threads, "Threads of computing")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app->add_option("--batch-scenes",
                  options.batch_scenes,
                  "Maximum number of scenes that are personalized together, sharing the encoder")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app->add_option("--memory-mib",
                  settings.memory_mib,
                  "Memory limit of this process and of each that it starts, MiB; 0: no limit")
      ->check(CLI::Range(int64_t{0}, kMaxMemoryMib));
  app->add_flag("!--no-sandbox", settings.sandbox, "Do not lock this process in");
  app->add_option("--log-format", settings.log_format, "text or json")
      ->check(CLI::IsMember({"text", "json"}));
  app->add_option("--log-level", settings.log_level, "trace, debug, info, warn, error, off")
      ->capture_default_str();
  app->add_option("--model", arguments->models, "NAME=FILE: weights for jobs")
      ->allow_extra_args(false);
  app->add_option("--backend", arguments->backends, "NAME=ADDRESS: a ColorBackend server")
      ->allow_extra_args(false);
  app->add_option("--otlp-endpoint",
                  settings.otlp_endpoint,
                  "http[s]://HOST:PORT of a collector of OpenTelemetry that receives traces. "
                  "Default: OTEL_EXPORTER_OTLP_ENDPOINT");
  app->add_option("--inference",
                  arguments->inference,
                  "Answer ColorizeImages on this socket of the server instead of running jobs");
  app->add_option("--max-batch", arguments->max_batch)->group("");
  app->add_option("--idle-seconds", arguments->idle_seconds)->group("");
  app->add_option("--parent-pid", options.parent)->group("");
  VisitTimings(settings,
               [app](const char* flag, auto& value) { app->add_option(flag, value)->group(""); });
  app->add_option("--drain-grace-seconds", settings.drain_grace_seconds)->group("");
  app->add_option("--reserve-mib", settings.reserve_mib)->group("");
  app->add_option("--blob-cache-mib", settings.blob_cache_mib)->group("");
  app->add_flag("--send-logs", settings.sends_logs)->group("");
  app->add_option("--recycle-jobs", options.recycle_jobs)->group("");
  app->add_option("--code-version", options.code_version)->group("");
}

// Completes the place of the worker: the data folder of its server, or a folder of its own, which
// is returned.
std::unique_ptr<WorkerFolder> SetUpPlace(WorkerArguments* arguments) {
  WorkerOptions& options = arguments->options;
  if (!arguments->IsElsewhere()) {
    if (arguments->settings.data_folder.empty()) {
      throw InvalidArgument(
          "give --data-dir of a server on this machine, or --server ADDRESS of another one");
    }
    if (options.name.empty()) options.name = "worker-1";
    // The sandbox gives access to folders that exist.
    std::error_code ignored;
    std::filesystem::create_directories(DataPaths(arguments->settings.data_folder).Cache(),
                                        ignored);
    options.cache_bytes = arguments->settings.blob_cache_mib << 20;
    return nullptr;
  }
  if (options.name.empty()) options.name = HostName("worker");
  if (!arguments->token_file.empty()) options.server.token = ReadToken(arguments->token_file);
  if (arguments->cache_folder.empty()) arguments->cache_folder = DefaultWorkerFolder();
  arguments->settings.data_folder = arguments->cache_folder;
  options.cache_bytes = arguments->cache_mib << 20;
  options.idle_exit = Milliseconds(arguments->idle_exit_seconds);
  options.poll = std::chrono::seconds(1);
  return std::make_unique<WorkerFolder>(DataPaths(arguments->cache_folder));
}

void Complete(WorkerArguments* arguments) {
  const WorkerSettings& settings = arguments->settings;
  WorkerOptions& options = arguments->options;
  options.data_folder = settings.data_folder;
  options.threads = settings.threads;
  options.reserve_mib = settings.reserve_mib;
  options.sends_logs = settings.sends_logs;
  options.release = COLOR3D_VERSION;
  options.timing.lease = Milliseconds(settings.lease_seconds);
  options.timing.heartbeat = Milliseconds(settings.heartbeat_seconds);
  options.timing.stuck = Milliseconds(settings.stuck_seconds);
  options.timing.stop_grace = Milliseconds(settings.stop_grace_seconds);
  options.timing.drain_grace = Milliseconds(settings.drain_grace_seconds);
  options.checkpoint_interval = Milliseconds(settings.checkpoint_seconds);
  options.models = ParseUserModels(arguments->models, arguments->backends);
  // Another build may compute other results, which must not be reused.
  if (options.code_version.empty()) {
    options.code_version = std::string(COLOR3D_VERSION) + " " + DigestFile("/proc/self/exe").sha256;
  }
}

std::atomic<bool> g_draining{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

// Drains also on repeated signals: a stop may come from the service manager, from the server and,
// when that dies, from the kernel. The supervisor kills workers that do not end.
void OnTerminate(int) { g_draining = true; }

// A second signal from a terminal ends the worker at once.
void OnInterrupt(int) {
  if (g_draining.exchange(true)) ::_exit(1);
}

// A handler, not a blocked mask with sigwait: OpenBLAS starts threads while it is loaded, before
// main could block anything, and a signal that reaches one of them would kill the process.
void HandleStopSignals() {
  struct sigaction action {};
  action.sa_flags = SA_RESTART;
  action.sa_handler = OnTerminate;
  IgnoreStraySignals();
  // Batch systems send SIGUSR1 ahead of the end of their time (Slurm: --signal).
  for (const int signal : {SIGTERM, SIGHUP, SIGQUIT, SIGPWR, SIGXCPU, SIGUSR1}) {
    ::sigaction(signal, &action, nullptr);
  }
  action.sa_handler = OnInterrupt;
  ::sigaction(SIGINT, &action, nullptr);
}

// Sets g_draining ahead of a time, so that jobs are released by then.
class EndAhead {
 public:
  explicit EndAhead(std::chrono::steady_clock::time_point time)
      : thread_([this, time] {
          MutexLock lock(mutex_);
          while (!over_ && wake_.WaitUntil(mutex_, time)) {
          }
          if (over_) return;
          spdlog::info("the time of --until is near; this worker ends");
          g_draining = true;
        }) {}
  ~EndAhead() {
    {
      const MutexLock lock(mutex_);
      over_ = true;
    }
    wake_.NotifyAll();
    thread_.join();
  }
  EndAhead(const EndAhead&) = delete;
  EndAhead& operator=(const EndAhead&) = delete;

 private:
  Mutex mutex_;
  CondVar wake_;
  bool over_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last, because it uses the others
};

// Null without --until.
std::unique_ptr<EndAhead> EndBefore(const WorkerArguments& arguments) {
  if (arguments.until.empty()) return nullptr;
  // To stop the stage, and to send its checkpoint.
  const auto ahead =
      Milliseconds(arguments.settings.drain_grace_seconds) + std::chrono::seconds(15);
  return std::make_unique<EndAhead>(ParseUntil(arguments.until) - ahead);
}

// Uploads may need much memory: this process fails before the machine does.
void LimitMemory(int64_t memory_mib) {
  // Minimum for any computation.
  constexpr int64_t kLeastBytes = int64_t{256} << 20;
  // Sanitizers reserve terabytes, which would count.
  constexpr int64_t kMostReserved = int64_t{1} << 40;
  if (!PreferAsOomVictim()) {
    spdlog::warn("the kernel may kill the server before this worker when memory runs out");
  }
  if (memory_mib == 0) return;
  const int64_t reserved = OwnMemoryBytes();
  if (reserved > kMostReserved) {
    spdlog::warn("the memory of this program cannot be limited: it reserves {} MiB at its start",
                 reserved >> 20);
    return;
  }
  ProcessLimits limits;
  limits.memory_bytes = memory_mib << 20;
  if (limits.memory_bytes < reserved + kLeastBytes) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} MiB of memory are too little: the program reserves {} MiB at its start; give "
                "workers at least {} MiB each (color3d-server serve --worker-memory-mib)",
                memory_mib,
                reserved >> 20,
                (reserved + kLeastBytes) >> 20);
  }
  if (!LimitProcess(limits)) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the kernel does not let this worker limit its memory ({})",
                std::strerror(errno));
  }
  spdlog::info("memory limit {} MiB, {} MiB of it reserved", memory_mib, reserved >> 20);
}

// Null if traces are not exported.
std::shared_ptr<Tracer> MakeTracer(const TraceSettings& settings) {
  for (const std::string& warning : settings.warnings) spdlog::warn("{}", warning);
  return Tracer::Make(
      settings, COLOR3D_VERSION, [](const std::string& problem) { spdlog::warn("{}", problem); });
}

// Sandboxes this process, which decodes untrusted files. Earlier threads belong to OpenBLAS.
void EnterSandbox(const WorkerArguments& arguments, const TraceSettings& traces) {
  SetSandboxing(arguments.settings.sandbox);
  if (!arguments.settings.sandbox) return;
  ResetPeakMemory();     // so that it can be reset in the sandbox, too
  ProcessLimits limits;  // no core dumps: they would contain uploads
  limits.file_bytes = kMaxFileBytes;
  SandboxRules rules;
  rules.readable = {ProgramFolder().parent_path()};
  const UserModels models = ParseUserModels(arguments.models, arguments.backends);
  for (const auto& [name, file] : models.files) {
    for (const std::filesystem::path& part : FilesOfModel(file)) rules.readable.push_back(part);
  }
  if (!traces.target.certificate.empty()) rules.readable.push_back(traces.target.certificate);
  // Not the store, which only the server opens.
  const DataPaths paths(arguments.settings.data_folder);
  rules.writable = {paths.Blobs(),
                    paths.Scratch(),
                    paths.Cache(),
                    paths.Logs(),
                    paths.Sockets(),
                    std::filesystem::temp_directory_path()};
  rules.sockets = Sockets::kAll;  // model servers
  rules.may_start_processes = true;
  const Sandbox sandbox(rules);
  if (!LimitProcess(limits) || !sandbox.Enter()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "the kernel does not allow the sandbox of this worker ({}); use --no-sandbox",
                std::strerror(errno));
  }
  if (!sandbox.missing().empty()) {
    spdlog::warn("sandbox without {}, which this machine does not support", sandbox.missing());
  }
  if (!sandbox.active().empty()) spdlog::info("sandbox: {}", sandbox.active());
}

void ServeInference(const WorkerArguments& arguments, const WorkerProgram& program) {
  const DataPaths paths(arguments.settings.data_folder);
  ServerAccess server(paths,
                      LinkTiming::For(Milliseconds(arguments.settings.lease_seconds)),
                      COLOR3D_VERSION,
                      arguments.settings.reserve_mib << 20,
                      {arguments.options.name, arguments.options.cache_bytes});
  const std::unique_ptr<LiveEngine> engine =
      program.make_engine({server.blobs(),
                           ParseUserModels(arguments.models, arguments.backends),
                           arguments.settings.threads});
  InferenceOptions options;
  options.data_folder = arguments.settings.data_folder;
  options.socket = arguments.inference;
  options.name = arguments.options.name;
  options.parent = arguments.options.parent;
  options.max_batch = arguments.max_batch;
  options.idle = Milliseconds(arguments.idle_seconds);
  options.drain_grace = Milliseconds(arguments.settings.drain_grace_seconds);
  RunInference(options, *engine, g_draining);
}

}  // namespace

int WorkerMain(int argc, char** argv, const WorkerProgram& program) {
  WorkerArguments arguments;
  CLI::App app("Runs the jobs of a color3d server; started by 'color3d-server serve'.");
  app.set_version_flag("--version", COLOR3D_VERSION);
  arguments.options.name.clear();
  AddFlags(&app, &arguments);
  CLI11_PARSE(app, argc, argv);
  HandleStopSignals();
  ShareMallocArenas(arguments.settings.threads);
  KeepFreedMemory();
  if (arguments.options.parent != 0) {
    // The kernel signals this worker when the server dies.
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != arguments.options.parent) return 1;
  }
  try {
    const WorkerSettings& settings = arguments.settings;
    SetUpLog("worker", settings.log_level, settings.log_format, {});  // until it has a folder
    const std::unique_ptr<WorkerFolder> own = SetUpPlace(&arguments);
    const DataPaths paths(arguments.settings.data_folder);
    SetUpLog(arguments.options.name,
             arguments.settings.log_level,
             arguments.settings.log_format,
             paths.Logs() / (arguments.options.name + ".log"));
    const TraceSettings traces =
        ReadTraceSettings("color3d-worker", arguments.settings.otlp_endpoint);
    LimitMemory(arguments.settings.memory_mib);
    EnterSandbox(arguments, traces);
    if (arguments.inference.empty()) {
      Complete(&arguments);
      if (!arguments.IsElsewhere() && !settings.sends_logs) LogJobsTo(paths.JobLogs());
      const std::unique_ptr<EndAhead> until = EndBefore(arguments);
      if (program.instruction_set != nullptr) arguments.options.simd = program.instruction_set();
      const std::unique_ptr<StageRunner> runner = program.make_runner();
      // Its thread must be in the sandbox.
      const std::shared_ptr<Tracer> tracer = MakeTracer(traces);
      arguments.options.tracer = tracer;
      RunWorker(arguments.options, *runner, g_draining);
      if (tracer && !tracer->Flush()) spdlog::warn("the last traces were not sent");
    } else {
      ServeInference(arguments, program);
    }
    spdlog::shutdown();
    return 0;
  } catch (const Error& e) {
    spdlog::critical("{}", e.what());
    return 2;
  } catch (const std::exception& e) {
    spdlog::critical("unexpected: {}", e.what());
    return 1;
  }
}

}  // namespace color3d
