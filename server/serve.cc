#include "server/serve.h"

#include <fmt/format.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/memory.h"
#include "core/base/text/address.h"
#include "core/trace/tracer.h"
#include "server/access/certificate_roles.h"
#include "server/access/notify_targets.h"
#include "server/access/tls.h"
#include "server/access/tokens.h"
#include "server/backends/backend_address.h"
#include "server/backends/backend_prober.h"
#include "server/idle_exit.h"
#include "server/maintenance.h"
#include "server/metrics/server_metrics.h"
#include "server/net/descriptors.h"
#include "server/net/port_probe.h"
#include "server/net/self_probe.h"
#include "server/notify/notifier.h"
#include "server/notify/webhook.h"
#include "server/ops/notify.h"
#include "server/ops/process.h"
#include "server/ops/scale_command.h"
#include "server/ops/socket_folder.h"
#include "server/ops/stop_signals.h"
#include "server/rpc/rpc_server.h"
#include "server/storage/ballast.h"
#include "server/storage/data_folder.h"
#include "server/storage/upload_store.h"
#include "server/store/open_store.h"
#include "server/tracing/job_spans.h"
#include "server/worker/supervision/supervisor.h"
#include "server/worker/supervision/worker_settings.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kFewDescriptors = 4096;
// Added to the time in which a worker drains.
constexpr double kOrphanSeconds = 10.0;
// The libraries or the first photo alone need this much.
constexpr int64_t kLeastWorkerMemoryMib = 1024;

std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<int64_t>(seconds * 1000.0));
}

// Memory limit of a worker, MiB: that of the options, else this share of the machine's memory; 0
// (no limit) if that is unknown.
int64_t WorkerMemoryMib(const ServeOptions& options, double share) {
  if (options.worker_memory_mib > 0) return options.worker_memory_mib;
  const int64_t machine = MachineMemoryBytes();
  if (machine == INT64_MAX) return 0;
  return std::max(kLeastWorkerMemoryMib,
                  static_cast<int64_t>(share * static_cast<double>(machine >> 20)));
}

void CheckOptions(const ServeOptions& options) {
  if (options.worker_memory_mib > 0 && options.worker_memory_mib < kLeastWorkerMemoryMib) {
    throw InvalidArgument("--worker-memory-mib is {}; it must be 0 or at least {}",
                          options.worker_memory_mib,
                          kLeastWorkerMemoryMib);
  }
  CheckAddressForm("--listen", options.listen);
  if (!options.metrics_listen.empty()) CheckAddressForm("--metrics-listen", options.metrics_listen);
  CheckBlobPlace(options.blobs);
  if (options.data_folder.empty()) throw InvalidArgument("--data-dir is empty; name a folder");
  for (const std::string& target : options.notify_allow) CheckNotifyTarget(target);
  if (options.notify_allow.empty() == !options.notify_secret.empty()) {
    throw InvalidArgument("--notify-allow and --notify-secret require each other");
  }
  if (!options.metrics_listen.empty() && !IsLoopback(options.metrics_listen) &&
      !options.insecure_any_address) {
    throw Error(ErrorCode::kFailedPrecondition,
                "refusing to serve metrics on {} without authentication; use --metrics-listen "
                "127.0.0.1:PORT, or --insecure-any-address in a trusted network",
                options.metrics_listen);
  }
  if (!options.scale_command.empty()) CheckScaleCommand(options.scale_command);
  if (!options.certificate_roles.empty() && options.tls_client_ca.empty()) {
    throw InvalidArgument(
        "--certificate-roles requires --tls-client-ca: clients present no certificates without it");
  }
  if (!options.tls_client_ca.empty() && options.certificate_roles.empty() &&
      options.tokens.empty()) {
    throw Error(
        ErrorCode::kFailedPrecondition,
        "refusing to let every certificate of {} drain the server and see all projects; set roles "
        "with --certificate-roles FILE (lines NAME ROLE [PROJECT]; '* submit' for all others), or "
        "use --tokens",
        options.tls_client_ca.string());
  }
  const bool is_safe = !options.tls_certificate.empty() &&
                       (!options.tokens.empty() || !options.tls_client_ca.empty());
  if (!IsLoopback(options.listen) && !is_safe && !options.insecure_any_address) {
    throw Error(
        ErrorCode::kFailedPrecondition,
        "refusing to listen on {} without encryption and authentication; use --tls-cert, --tls-key "
        "and --tokens (or --tls-client-ca and --certificate-roles), listen on 127.0.0.1, or use "
        "--insecure-any-address in a trusted network",
        options.listen);
  }
}

SupervisorOptions WorkerSetup(const ServeOptions& options, const UserModels& models) {
  SupervisorOptions setup;
  setup.program =
      options.worker_program.empty() ? ProgramFolder() / "color3d-worker" : options.worker_program;
  if (options.workers > 0 && ::access(setup.program.c_str(), X_OK) != 0) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot find the worker program {}; install color3d-worker beside color3d-server, "
                "or use --workers 0",
                setup.program.string());
  }
  setup.workers = options.workers;
  const int machine = std::max(1u, std::thread::hardware_concurrency());
  const int threads =
      options.threads > 0 ? options.threads : std::max(1, machine / std::max(1, options.workers));
  const int64_t memory_mib = WorkerMemoryMib(options, 0.75 / std::max(1, options.workers));
  WorkerSettings settings = options.worker;
  settings.data_folder = options.data_folder;
  settings.threads = threads;
  settings.memory_mib = memory_mib;
  settings.blob_cache_mib = WorkerCacheMib(options.blobs, options.workers + 1);
  settings.drain_grace_seconds = options.drain_seconds * 0.75;
  settings.sends_logs = !options.store.empty();
  setup.arguments = ToFlags(settings);
  const std::vector<std::string> model_flags = ToFlags(models);
  setup.arguments.insert(setup.arguments.end(), model_flags.begin(), model_flags.end());
  setup.max_stopped = Milliseconds(3.0 * options.worker.lease_seconds);
  setup.max_silent = Milliseconds(std::max(3.0 * options.worker.lease_seconds, 60.0));
  setup.max_backoff = std::chrono::milliseconds(options.worker_backoff_ms);
  setup.first_backoff = std::min(setup.first_backoff, setup.max_backoff);
  return setup;
}

WorkerTimes TimesOfWorkers(const WorkerSettings& settings) {
  return {Milliseconds(settings.lease_seconds).count(),
          Milliseconds(settings.heartbeat_seconds).count(),
          Milliseconds(settings.checkpoint_seconds).count(),
          Milliseconds(settings.stuck_seconds).count()};
}

std::map<std::string, BackendState> ProbeForInfo(BackendProber& prober) {
  std::map<std::string, BackendState> states;
  for (const auto& [name, answer] : prober.Probe()) {
    states[name] = {answer.reachable,
                    answer.ready,
                    answer.info.description,
                    {answer.info.capabilities.begin(), answer.info.capabilities.end()},
                    answer.info.max_pixels,
                    answer.problem};
  }
  return states;
}

// Started by the first ColorizeImages call, if its program is installed.
InferenceLink InferenceSetup(const ServeOptions& options,
                             const UserModels& models,
                             const SocketFolder& sockets,
                             SupervisorOptions* setup) {
  if (::access(setup->program.c_str(), X_OK) != 0) return {};
  // Unique, because a worker that has outlived its server removes its socket at its end.
  const std::string socket = "inference-" + fmt::to_string(::getpid());
  const int machine = std::max(1u, std::thread::hardware_concurrency());
  WorkerSettings settings = options.worker;
  settings.data_folder = options.data_folder;
  settings.threads = options.live_threads > 0 ? options.live_threads : machine;
  settings.memory_mib = WorkerMemoryMib(options, 0.5);
  settings.blob_cache_mib = WorkerCacheMib(options.blobs, options.workers + 1);
  settings.drain_grace_seconds = options.drain_seconds * 0.5;
  std::vector<std::string>& arguments = setup->inference_arguments;
  arguments = ToFlags(settings);
  const std::vector<std::string> model_flags = ToFlags(models);
  arguments.insert(arguments.end(), model_flags.begin(), model_flags.end());
  arguments.insert(arguments.end(), {"--inference", socket});
  const auto demand = std::make_shared<InferenceDemand>();
  setup->inference_demand = demand;
  InferenceLink link;
  link.target = sockets.Address(socket);
  link.demand = [demand] { demand->Request(); };
  link.hold = [demand] { return demand->Hold(); };
  return link;
}

ServerSample SampleOf(const ServeOptions& options,
                      const RpcServer& server,
                      const Maintenance& maintenance,
                      const BlobStore& blobs,
                      const SelfProbe& probe,
                      const Tracer* tracer,
                      bool draining) {
  const RpcServer::Open open = server.open();
  const ChoreCounts& counts = maintenance.counts();
  ServerSample sample;
  sample.watches = open.watches;
  sample.downloads = open.downloads;
  sample.uploads = open.uploads;
  sample.live_pictures = open.live_pictures;
  sample.draining = draining;
  sample.answering = probe.IsAnswering();
  sample.attempts_lost = counts.attempts_lost;
  sample.blobs_removed = counts.blobs_removed;
  sample.blobs_damaged = blobs.damaged();
  sample.jobs_expired = counts.jobs_expired;
  sample.sweeps_failed = counts.sweeps_failed;
  if (tracer != nullptr) sample.spans_dropped = tracer->counts().dropped;
  const ConnectionGate::Counts connections = server.connections();
  sample.connections = connections.open;
  sample.silent_connections = connections.silent;
  sample.max_connections = connections.max;
  sample.connections_closed = connections.closed;
  sample.connections_refused = connections.refused;
  sample.reserve_bytes = options.worker.reserve_mib << 20;
  if (!options.tls_certificate.empty()) {
    sample.certificate_end_s = CertificateEnd(options.tls_certificate);
  }
  return sample;
}

// Null without --scale-command.
std::unique_ptr<ScaleCommand> StartScaling(const ServeOptions& options,
                                           const DataPaths& paths,
                                           JobStore& store,
                                           const std::function<bool()>& has_chores) {
  if (options.scale_command.empty()) return nullptr;
  ScaleCommandOptions scale;
  scale.program = options.scale_command;
  scale.max_workers = options.scale_max;
  scale.output = paths.root / "scale-command.log";
  scale.pause = Milliseconds(options.scale_seconds);
  // Of all servers on the store one asks. Its own workers need no engine.
  return std::make_unique<ScaleCommand>(
      scale, [&store, has_chores, own = options.workers]() -> std::optional<int64_t> {
        if (!has_chores()) return std::nullopt;
        const JobCounts counts = store.CountJobs();
        const int64_t waiting = store.Holds().empty() ? counts.queued - counts.blocked : 0;
        return waiting + counts.running - own;
      });
}

// Null if traces are not exported.
std::shared_ptr<Tracer> MakeTracer(const ServeOptions& options) {
  const TraceSettings settings = ReadTraceSettings("color3d-server", options.worker.otlp_endpoint);
  for (const std::string& warning : settings.warnings) spdlog::warn("{}", warning);
  if (settings.target.url.empty()) return nullptr;
  spdlog::info("traces are sent to {}", settings.target.url);
  if (options.workers > 0 && !settings.target.headers.empty()) {
    spdlog::warn(
        "workers of this machine do not get OTEL_EXPORTER_OTLP_HEADERS, because they decode "
        "uploads: if the collector requires them, run one without on this machine");
  }
  return Tracer::Make(
      settings, COLOR3D_VERSION, [](const std::string& problem) { spdlog::warn("{}", problem); });
}

// Probes like a client. While the gate has no room, it has reported that itself.
std::string ProbeOwnServer(const RpcServer& server,
                           const TlsFiles& tls,
                           std::chrono::milliseconds limit) {
  const int64_t refused = server.connections().refused;
  const std::string why = ProbePort({server.address(), !tls.empty()}, limit);
  return server.connections().refused == refused ? why : "";
}

}  // namespace

void Serve(const ServeOptions& options) {
  SetUpLog("server", options.worker.log_level, options.worker.log_format, {});
  if (RaiseDescriptorLimit() < kFewDescriptors) {
    spdlog::warn("only {} files and connections may be open (ulimit -n); raise it to {} or more",
                 DescriptorLimit(),
                 kFewDescriptors);
  }
  CheckOptions(options);
  const UserModels models = ParseUserModels(options.models, options.backends);
  RequireReadable(models);
  for (const auto& [name, address] : models.backends) ParseBackendAddress(name, address);
  SupervisorOptions worker_setup = WorkerSetup(options, models);
  const std::shared_ptr<Tracer> tracer = MakeTracer(options);
  NotifierOptions notify;
  notify.allowed = options.notify_allow;
  if (!options.notify_secret.empty()) notify.secret = ReadWebhookSecret(options.notify_secret);
  const StopSignals signals;
  const DataPaths paths(options.data_folder);
  PrepareDataFolder(paths);
  const DataFolderLock lock(paths);
  worker_setup.orphans = std::make_shared<OrphanedWorkers>(
      paths.root, Milliseconds(options.drain_seconds + kOrphanSeconds));
  const SocketFolder sockets(paths.Sockets());
  sockets.RemoveAll();
  const Clock clock = SystemClock();
  StoreOptions store_options;
  store_options.program_version = COLOR3D_VERSION;
  store_options.retry_backoff_ms = options.worker.retry_backoff_ms;
  store_options.max_attempts = options.max_attempts;
  const OpenedStore opened = OpenStore(options.store, paths.Store(), store_options);
  JobStore& store = *opened.store;
  notify.sends = opened.has_chores;
  BlobPlaceOptions place = options.blobs;
  place.reserve_mib = options.worker.reserve_mib;
  const OpenedBlobs kept = OpenBlobs(place, paths, options.store.empty() ? "" : opened.name);
  BlobStore& blobs = *kept.blobs;
  Ballast ballast(paths.BallastFile(), BallastBytes(paths.root));
  RpcServerOptions rpc;
  rpc.listen = options.listen;
  rpc.version = COLOR3D_VERSION;
  rpc.limits.max_unfinished_jobs = options.max_unfinished_jobs;
  rpc.limits.project_max_unfinished_jobs = options.project_jobs;
  rpc.limits.project_max_streams = options.project_streams;
  rpc.limits.project_max_stored_bytes = static_cast<int64_t>(options.project_gib * (1 << 30));
  rpc.limits.project_max_scenes = options.project_scenes;
  rpc.limits.low_space_bytes = options.low_space_mib << 20;
  rpc.job_logs = opened.job_logs == nullptr ? MakeFileJobLogs(paths.JobLogs())
                                            : MakeSharedJobLogs(*opened.job_logs, paths.JobLogs());
  rpc.make_room = [&ballast] { return ballast.Release(); };
  rpc.notify_allowed = options.notify_allow;
  rpc.drain = [] { ::kill(::getpid(), SIGTERM); };
  rpc.models = models;
  rpc.worker_socket = sockets.Address(kWorkerSocket);
  rpc.worker_times = TimesOfWorkers(options.worker);
  rpc.tracer = tracer;
  rpc.inference = InferenceSetup(options, models, sockets, &worker_setup);
  const auto prober = std::make_shared<BackendProber>(models.backends);
  rpc.probe_backends = [prober] { return ProbeForInfo(*prober); };
  const TlsFiles tls{options.tls_certificate, options.tls_key, options.tls_client_ca};
  if (!tls.empty()) rpc.credentials = MakeServerCredentials(tls);
  if (!options.tokens.empty()) rpc.tokens = std::make_shared<TokenBook>(options.tokens);
  if (!options.certificate_roles.empty()) {
    rpc.certificates = std::make_shared<CertificateRoles>(options.certificate_roles);
  }
  rpc.max_connections = options.max_connections;
  UploadStore uploads(paths.Uploads(), blobs, rpc.limits.max_blob_bytes);
  ExpireDeadWorkers(store);
  std::optional<JobSpans> job_spans;
  if (tracer) {
    JobSpansOptions spans;
    spans.records = opened.has_chores;
    job_spans.emplace(store, tracer, spans);
  }

  ServerMetrics metrics(COLOR3D_VERSION);
  std::atomic<IdleWatch*> idle_watch{nullptr};
  rpc.on_call = [&](const std::string& method, grpc::StatusCode code, double seconds) {
    metrics.CountCall(method, StatusName(code), seconds);
    if (IdleWatch* const watch = idle_watch) watch->NoteCall(method);
  };
  RpcServer server(rpc, store, blobs, uploads, clock);
  std::atomic<bool> draining{false};
  std::string deaf;  // reason, once the server does not answer
  SelfProbeTiming probe_timing;
  probe_timing.pause = Milliseconds(options.probe_seconds);
  const auto probe = std::make_unique<SelfProbe>(
      probe_timing,
      [&](std::chrono::milliseconds limit) {
        const std::string why = ProbeOwnServer(server, tls, limit);
        return draining ? "" : why;  // a draining server closes its port
      },
      [&](const std::string& why) {
        if (draining) return;
        deaf = why;
        ::kill(::getpid(), SIGTERM);
      });
  if (!options.port_file.empty()) WriteFileAtomic(options.port_file, server.address() + "\n");
  MaintenanceTiming chores;
  chores.reap = std::clamp(Milliseconds(options.worker.lease_seconds / 10.0),
                           std::chrono::milliseconds(100),
                           std::chrono::milliseconds(5'000));
  // No sign of life while the store is unreadable or calls are not answered: the watchdog of
  // systemd then restarts the server.
  chores.keep_jobs = std::chrono::hours(24) * options.keep_days;
  chores.keep_uncommitted = std::chrono::hours(24) * options.keep_uncommitted_days;
  chores.forget_workers = 3 * Milliseconds(options.worker.lease_seconds);
  chores.low_space_bytes = options.low_space_mib << 20;
  chores.has_chores = opened.has_chores;
  chores.ballast = &ballast;
  chores.reserve_bytes = options.worker.reserve_mib << 20;
  chores.on_life = [&probe] {
    if (probe->IsAnswering()) NotifyServiceManager("WATCHDOG=1");
  };
  Maintenance maintenance(store, blobs, uploads, paths, clock, chores);
  std::optional<Notifier> notifier;
  if (!options.notify_allow.empty()) notifier.emplace(store, clock, notify);
  Supervisor supervisor(worker_setup, store);
  std::unique_ptr<ScaleCommand> scaling = StartScaling(options, paths, store, opened.has_chores);
  const std::shared_ptr<void> stop_metrics(nullptr, [&](void*) { metrics.StopListening(); });
  if (!options.metrics_listen.empty()) {
    const int port = metrics.Listen(options.metrics_listen, store, blobs, [&] {
      return SampleOf(options, server, maintenance, blobs, *probe, tracer.get(), draining);
    });
    spdlog::info("metrics on port {}", port);
  }
  spdlog::info("listening on {}{}{}, data in {}, jobs in {}, blobs in {}, {} workers",
               server.address(),
               tls.empty() ? "" : " with TLS",
               options.tokens.empty() && options.certificate_roles.empty()
                   ? ""
                   : ", for those with a token or a role",
               paths.root.string(),
               opened.name,
               kept.name,
               options.workers);

  const auto idle = ExitWhenIdle(Milliseconds(options.idle_exit_seconds), store, server);
  idle_watch = idle.get();
  NotifyServiceManager("READY=1");

  signals.Wait([] {
    spdlog::info(
        "SIGHUP: tokens, roles and certificates are read again by themselves; whatever else "
        "changed "
        "needs a restart");
  });
  draining = true;
  NotifyServiceManager("STOPPING=1");
  spdlog::info("draining: no new jobs, running ones are saved and released");
  signals.ExitOnNext();
  scaling.reset();
  server.StartDraining();
  supervisor.Drain(Milliseconds(options.drain_seconds * 0.9));
  supervisor.Wait();
  kept.stop();
  server.Shutdown(Milliseconds(std::min(2.0, options.drain_seconds * 0.1)));
  job_spans.reset();
  if (tracer && !tracer->Flush()) spdlog::warn("the last traces were not sent");
  spdlog::info("ended");
  if (!deaf.empty()) {
    throw Error(ErrorCode::kUnavailable,
                "ended, because {} no longer answered calls ({}); start it again",
                server.address(),
                deaf);
  }
}

}  // namespace color3d
