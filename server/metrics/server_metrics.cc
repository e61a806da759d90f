#include "server/metrics/server_metrics.h"

#include <prometheus/counter.h>
#include <prometheus/exposer.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/mutex.h"
#include "server/net/descriptors.h"

namespace color3d {
namespace {
using prometheus::ClientMetric;
using prometheus::Labels;
using prometheus::MetricFamily;
using prometheus::MetricType;

constexpr int kEventsAtOnce = 500;
const prometheus::Histogram::BucketBoundaries kSeconds = {
    0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5, 1, 5, 30, 300};

ClientMetric Value(MetricType type, double value, const Labels& labels = {}) {
  ClientMetric metric;
  for (const auto& [name, text] : labels) metric.label.push_back({name, text});
  (type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
  return metric;
}

// Such workers claim no jobs.
bool IsForLivePictures(const WorkerRecord& worker) {
  return worker.worker_id.starts_with("inference-");
}

// Metrics that are read from the store at each scrape.
class Sampled : public prometheus::Collectable {
 public:
  Sampled(ClientStore& store,
          const BlobStore& blobs,
          std::function<ServerSample()> sample,
          prometheus::Family<prometheus::Counter>& jobs_ended,
          prometheus::Family<prometheus::Counter>& job_seconds)
      : store_(store),
        blobs_(blobs),
        sample_(std::move(sample)),
        jobs_ended_(jobs_ended),
        job_seconds_(job_seconds),
        revision_(store.NewestRevision()) {}

  std::vector<MetricFamily> Collect() const override {
    std::vector<MetricFamily> families;
    try {
      CountEnded();
      AddQueue(&families);
      AddServer(&families);
    } catch (const std::exception& e) {
      spdlog::warn("cannot read the metrics: {}", e.what());
    }
    return families;
  }

 private:
  // Counts the jobs that have ended since the last scrape.
  void CountEnded() const {
    const MutexLock lock(mutex_);
    while (true) {
      const auto events = store_.EventsSince(revision_, kEventsAtOnce);
      std::vector<int64_t> ended;
      for (const EventRecord& event : events) {
        if (event.kind == EventKind::kState && IsFinished(event.state)) {
          ended.push_back(event.job_id);
        }
      }
      for (const JobRecord& job : store_.Snapshot(ended).jobs) {
        jobs_ended_.Add({{"kind", job.kind}, {"state", JobStateName(job.state)}}).Increment();
        if (!job.cached) job_seconds_.Add({{"kind", job.kind}}).Increment(job.usage.seconds);
      }
      if (!events.empty()) revision_ = events.back().revision;
      if (events.size() < static_cast<size_t>(kEventsAtOnce)) return;
    }
  }

  static void Add(std::vector<MetricFamily>* families,
                  const char* name,
                  const char* help,
                  MetricType type,
                  double value) {
    families->push_back({name, help, type, {Value(type, value)}});
  }
  // Adds a gauge with one value for each value of a label.
  static void AddByLabel(std::vector<MetricFamily>* families,
                         const char* name,
                         const char* help,
                         const char* label,
                         std::initializer_list<std::pair<const char*, int64_t>> values) {
    MetricFamily family{name, help, MetricType::Gauge, {}};
    for (const auto& [text, value] : values) {
      family.metric.push_back(
          Value(MetricType::Gauge, static_cast<double>(value), {{label, text}}));
    }
    families->push_back(std::move(family));
  }

  void AddQueue(std::vector<MetricFamily>* families) const {
    const JobCounts counts = store_.CountJobs();
    AddByLabel(families,
               "color3d_jobs",
               "Number of unfinished jobs.",
               "state",
               {{"blocked", counts.blocked},
                {"queued", counts.queued - counts.blocked},
                {"running", counts.running}});
    const int64_t now = SystemClock()();
    const int64_t oldest = counts.oldest_queued_ms;
    Add(families,
        "color3d_oldest_queued_seconds",
        "Waiting time of the job at the front of the queue.",
        MetricType::Gauge,
        oldest > 0 ? static_cast<double>(std::max<int64_t>(now - oldest, 0)) / 1000.0 : 0.0);
    Add(families,
        "color3d_notifications",
        "Number of notifications not delivered yet.",
        MetricType::Gauge,
        static_cast<double>(counts.notifications));
    const std::set<Hold> holds = store_.Holds();
    AddByLabel(
        families,
        "color3d_queue_held",
        "1 if no job is started, by reason.",
        "reason",
        {{"paused", holds.contains(Hold::kPaused)}, {"storage", holds.contains(Hold::kStorage)}});
    AddWorkers(families, now);
  }

  void AddWorkers(std::vector<MetricFamily>* families, int64_t now) const {
    int idle = 0, busy = 0, live = 0;
    double silent = 0.0;
    WorkerRecord sum;
    for (const WorkerRecord& worker : store_.ListWorkers()) {
      ++(IsForLivePictures(worker) ? live : worker.job.empty() ? idle : busy);
      silent = std::max(silent, static_cast<double>(now - worker.heartbeat_ms) / 1000.0);
      sum.threads += worker.threads;
      sum.cache_bytes += worker.cache_bytes;
      sum.cache_limit_bytes += worker.cache_limit_bytes;
      sum.cache_hit_bytes += worker.cache_hit_bytes;
      sum.cache_miss_bytes += worker.cache_miss_bytes;
    }
    AddByLabel(families,
               "color3d_workers",
               "Worker processes.",
               "state",
               {{"idle", idle}, {"busy", busy}, {"live", live}});
    Add(families,
        "color3d_worker_silence_seconds",
        "Longest time since the last heartbeat of a worker.",
        MetricType::Gauge,
        silent);
    Add(families,
        "color3d_worker_threads",
        "Threads that all workers compute with.",
        MetricType::Gauge,
        sum.threads);
    AddByLabel(families,
               "color3d_worker_cache_bytes",
               "Files in the caches of all workers, and their limits.",
               "kind",
               {{"used", sum.cache_bytes}, {"limit", sum.cache_limit_bytes}});
    AddByLabel(families,
               "color3d_worker_read_bytes",
               "Bytes of files that the present workers have read since their start.",
               "source",
               {{"cache", sum.cache_hit_bytes}, {"server", sum.cache_miss_bytes}});
  }

  void AddServer(std::vector<MetricFamily>* families) const {
    const ServerSample sample = sample_();
    AddByLabel(
        families,
        "color3d_open_streams",
        "Number of open streams.",
        "kind",
        {{"watch", sample.watches}, {"download", sample.downloads}, {"upload", sample.uploads}});
    const auto gauge = [&](const char* name, const char* help, double value) {
      Add(families, name, help, MetricType::Gauge, value);
    };
    const auto counter = [&](const char* name, const char* help, int64_t value) {
      Add(families, name, help, MetricType::Counter, static_cast<double>(value));
    };
    gauge(
        "color3d_live_pictures", "Number of live pictures not answered yet.", sample.live_pictures);
    gauge("color3d_draining", "1 while the server drains.", sample.draining);
    gauge("color3d_disk_free_bytes",
          "Free space of the data folder, less the space reserved by uploads.",
          static_cast<double>(blobs_.FreeBytes()));
    gauge("color3d_disk_reserve_bytes",
          "Free space below which uploads and jobs fail.",
          static_cast<double>(sample.reserve_bytes));
    gauge("color3d_memory_bytes",
          "Resident memory of the server process without its workers.",
          static_cast<double>(ResidentMemoryBytes()));
    gauge("color3d_open_descriptors",
          "Number of open descriptors of the server process.",
          static_cast<double>(OpenDescriptors()));
    gauge("color3d_max_descriptors",
          "Maximum number of open descriptors of the server process.",
          static_cast<double>(DescriptorLimit()));
    AddByLabel(families,
               "color3d_connections",
               "Number of open connections.",
               "state",
               {{"open", sample.connections}, {"silent", sample.silent_connections}});
    gauge("color3d_max_connections",
          "Maximum number of open connections.",
          static_cast<double>(sample.max_connections));
    counter("color3d_connections_closed_total",
            "Connections without calls that were closed to make room.",
            sample.connections_closed);
    counter("color3d_connections_refused_total",
            "Connections refused for lack of room.",
            sample.connections_refused);
    gauge("color3d_answering", "1 if the server answers its own calls.", sample.answering);
    if (sample.certificate_end_s > 0) {
      gauge("color3d_certificate_end_seconds",
            "Expiry time of the TLS certificate, since the epoch.",
            static_cast<double>(sample.certificate_end_s));
    }
    counter(
        "color3d_attempts_lost_total", "Attempts lost with their worker.", sample.attempts_lost);
    counter("color3d_blobs_removed_total",
            "Unreferenced blobs removed by the garbage collector.",
            sample.blobs_removed);
    counter("color3d_blobs_damaged_total",
            "Damaged blobs found by sweeps, downloads and uploads.",
            sample.blobs_damaged);
    counter("color3d_jobs_expired_total",
            "Jobs deleted after their retention period.",
            sample.jobs_expired);
    counter("color3d_sweeps_failed_total", "Failed sweeps.", sample.sweeps_failed);
    counter("color3d_trace_spans_dropped_total",
            "Spans of traces that the collector did not take.",
            sample.spans_dropped);
  }

  ClientStore& store_;
  const BlobStore& blobs_;
  const std::function<ServerSample()> sample_;
  prometheus::Family<prometheus::Counter>& jobs_ended_;
  prometheus::Family<prometheus::Counter>& job_seconds_;
  mutable Mutex mutex_;
  mutable int64_t revision_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace

struct ServerMetrics::Parts {
  std::shared_ptr<prometheus::Registry> registry = std::make_shared<prometheus::Registry>();
  prometheus::Family<prometheus::Counter>& calls =
      prometheus::BuildCounter()
          .Name("color3d_rpc_calls_total")
          .Help("Finished calls, by method and status code.")
          .Register(*registry);
  prometheus::Family<prometheus::Histogram>& seconds =
      prometheus::BuildHistogram()
          .Name("color3d_rpc_seconds")
          .Help("Duration of calls; of streams, the time they were open.")
          .Register(*registry);
  prometheus::Family<prometheus::Counter>& jobs_ended =
      prometheus::BuildCounter()
          .Name("color3d_jobs_ended_total")
          .Help("Finished jobs, by kind and state.")
          .Register(*registry);
  prometheus::Family<prometheus::Counter>& job_seconds =
      prometheus::BuildCounter()
          .Name("color3d_job_seconds_total")
          .Help("Computing time of finished jobs over all attempts, seconds.")
          .Register(*registry);
  std::shared_ptr<Sampled> sampled;
  std::unique_ptr<prometheus::Exposer> exposer;  // destroyed first, because it reads the others
};

ServerMetrics::ServerMetrics(const std::string& version) : parts_(std::make_unique<Parts>()) {
  prometheus::BuildGauge()
      .Name("color3d_build_info")
      .Help("Always 1.")
      .Register(*parts_->registry)
      .Add({{"version", version}})
      .Set(1);
}

ServerMetrics::~ServerMetrics() = default;

void ServerMetrics::CountCall(const std::string& method, const std::string& code, double seconds) {
  const std::string name = method.substr(method.find_first_not_of('/'));
  parts_->calls.Add({{"method", name}, {"code", code}}).Increment();
  parts_->seconds.Add({{"method", name}}, kSeconds).Observe(seconds);
}

int ServerMetrics::Listen(const std::string& address,
                          ClientStore& store,
                          const BlobStore& blobs,
                          std::function<ServerSample()> sample) {
  try {
    // Silent connections end soon, because each occupies one of few threads.
    parts_->exposer =
        std::make_unique<prometheus::Exposer>(std::vector<std::string>{"listening_ports",
                                                                       address,
                                                                       "num_threads",
                                                                       "8",
                                                                       "request_timeout_ms",
                                                                       "500",
                                                                       "enable_keep_alive",
                                                                       "no"});
  } catch (const std::runtime_error&) {  // the exception has no reason
    throw Error(
        ErrorCode::kFailedPrecondition,
        "cannot listen for --metrics-listen on {}: it must be HOST:PORT of this machine, and "
        "free",
        address);
  }
  parts_->sampled = std::make_shared<Sampled>(
      store, blobs, std::move(sample), parts_->jobs_ended, parts_->job_seconds);
  // In this order, because Sampled counts ended jobs.
  parts_->exposer->RegisterCollectable(parts_->sampled);
  parts_->exposer->RegisterCollectable(parts_->registry);
  return parts_->exposer->GetListeningPorts().at(0);
}

void ServerMetrics::StopListening() { parts_->exposer.reset(); }

}  // namespace color3d
