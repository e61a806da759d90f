// Commands about workers and the queue: server workers, queue, top, weight.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/text.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

std::string ProjectName(const std::string& project) { return project.empty() ? "-" : project; }

// "used of limit", or "-" without a limit.
std::string OfLimit(int64_t used, int64_t limit) {
  return limit == 0 ? "-" : HumanBytes(used) + " of " + HumanBytes(limit);
}

// Share of the read bytes that came from the cache.
std::string HitRate(const v1::WorkerInfo& worker) {
  const int64_t read = worker.cache_hit_bytes() + worker.cache_miss_bytes();
  if (read == 0) return "-";
  return fmt::format("{:.0f} %", 100.0 * worker.cache_hit_bytes() / static_cast<double>(read));
}

std::string WorkerTable(const v1::ServerInfo& info) {
  std::vector<std::vector<std::string>> rows{
      {"WORKER", "MACHINE", "THREADS", "MEMORY", "CACHE", "HITS", "DONE", "SEEN", "JOB"}};
  for (const v1::WorkerInfo& worker : info.workers()) {
    rows.push_back({worker.worker_id(),
                    worker.machine().empty() ? "-" : worker.machine(),
                    fmt::format("{} {}", worker.threads(), worker.simd()),
                    OfLimit(worker.memory_bytes(), worker.memory_limit_bytes()),
                    OfLimit(worker.cache_bytes(), worker.cache_limit_bytes()),
                    HitRate(worker),
                    fmt::to_string(worker.finished_jobs()),
                    HumanSeconds(worker.heartbeat_age_seconds()) + " ago",
                    worker.job().empty() ? "idle" : worker.job()});
  }
  return rows.size() == 1 ? "no workers\n" : Table(std::move(rows));
}

std::string QueueTable(const v1::ListQueueResponse& queue) {
  std::string text = fmt::format("{} waiting for a worker, {} waiting for other jobs",
                                 queue.waiting_jobs(),
                                 queue.blocked_jobs());
  if (queue.longest_wait_seconds() > 0.0) {
    text += ", longest wait " + HumanSeconds(queue.longest_wait_seconds());
  }
  text += "\n";
  if (!queue.waits_for().empty()) text += "no job starts; waits for: " + queue.waits_for() + "\n";
  std::vector<std::vector<std::string>> rows{
      {"JOB", "KIND", "PROJECT", "PRIORITY", "STATE", "TIME", "MEMORY", "DEADLINE", "WORKER"}};
  for (const v1::QueuedJob& job : queue.jobs()) {
    const bool runs = job.state() == v1::Job::STATE_RUNNING;
    rows.push_back({job.name(),
                    job.kind(),
                    ProjectName(job.project()),
                    fmt::to_string(job.priority()),
                    runs ? "running" : "waiting",
                    HumanSeconds(job.seconds()),
                    job.memory_bytes() == 0 ? "-" : HumanBytes(job.memory_bytes()),
                    job.has_deadline() ? HumanTime(job.deadline()) : "-",
                    !job.waits_for().empty() ? "waits for " + job.waits_for()
                    : job.worker().empty()   ? "-"
                    : runs                   ? job.worker()
                                             : "prefers " + job.worker()});
  }
  return rows.size() == 1 ? text : text + Table(std::move(rows));
}

v1::ListQueueResponse GetQueue(Connection& connection, int max_waiting) {
  v1::ListQueueRequest request;
  request.set_max_waiting_jobs(max_waiting);
  return connection.Call(&v1::AdminService::Stub::ListQueue, connection.admin(), request);
}

ExitCode RunWorkers(const Context& context) {
  Connection connection(context.server, *context.interrupt);
  const v1::ServerInfo info = GetServerInfo(connection);
  if (context.json) {
    nlohmann::ordered_json workers = nlohmann::ordered_json::array();
    for (const v1::WorkerInfo& worker : info.workers()) workers.push_back(ToJson(worker));
    PrintJson({{"workers", workers}});
    return ExitCode::kOk;
  }
  PrintText(WorkerTable(info));
  return ExitCode::kOk;
}

ExitCode RunQueue(const Context& context, int max_waiting) {
  Connection connection(context.server, *context.interrupt);
  const v1::ListQueueResponse queue = GetQueue(connection, max_waiting);
  return PrintAnswer(context, queue, QueueTable(queue));
}

// Shows workers and queue again and again until it is interrupted.
ExitCode RunTop(const Context& context, double seconds) {
  constexpr int kWaiting = 20;
  constexpr char kClear[] = "\x1b[H\x1b[2J";
  if (context.json) {
    throw Error(
        ErrorCode::kInvalidArgument,
        "'server top' draws a screen; use 'server queue --json' and 'server workers --json'");
  }
  Connection connection(context.server, *context.interrupt);
  const bool on_terminal = ::isatty(STDOUT_FILENO) != 0;
  while (!context.interrupt->IsCancelled()) {
    const v1::ServerInfo info = GetServerInfo(connection);
    const std::string text = QueueTable(GetQueue(connection, kWaiting)) + "\n" + WorkerTable(info);
    if (on_terminal) std::fputs(kClear, stdout);
    PrintText(text);
    std::fflush(stdout);
    if (!on_terminal) break;  // one picture for a file or a pipe
    const auto next = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!context.interrupt->IsCancelled() && std::chrono::steady_clock::now() < next) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  return ExitCode::kOk;
}

ExitCode RunWeight(const Context& context, const v1::SetProjectWeightRequest& request) {
  Connection connection(context.server, *context.interrupt);
  const v1::ProjectUsage usage =
      connection.Call(&v1::AdminService::Stub::SetProjectWeight, connection.admin(), request);
  return PrintAnswer(context,
                     usage,
                     fmt::format("the weight of {} is {}\n",
                                 usage.project().empty() ? "the default project" : usage.project(),
                                 usage.weight()));
}

}  // namespace

void AddQueueCommands(CLI::App& server, Context& context) {
  AddCommand(
      server, context, "workers", "Show the workers, their caches and their jobs", [&context] {
        return RunWorkers(context);
      });
  const auto waiting = std::make_shared<int>(50);
  AddCommand(
      server,
      context,
      "queue",
      "Show running and waiting jobs of all projects in the order of their turns (role admin)",
      [&context, waiting] { return RunQueue(context, *waiting); })
      ->add_option("--waiting", *waiting, "Maximum number of waiting jobs")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  const auto seconds = std::make_shared<double>(2.0);
  AddCommand(server,
             context,
             "top",
             "Show queue and workers until Ctrl-C (role admin)",
             [&context, seconds] { return RunTop(context, *seconds); })
      ->add_option("--interval", *seconds, "Time between two readings, s")
      ->check(CLI::Range(0.5, 3600.0))
      ->capture_default_str();
  const auto project = std::make_shared<std::string>();
  const auto weight = std::make_shared<int>(1);
  CLI::App* set = AddCommand(server,
                             context,
                             "weight",
                             "Set the share of a project in the queue (role admin)",
                             [&context, project, weight] {
                               v1::SetProjectWeightRequest request;
                               request.set_project(*project);
                               request.set_weight(*weight);
                               return RunWeight(context, request);
                             });
  set->add_option("PROJECT", *project, "Name of the project; \"\": the default project")
      ->required();
  set->add_option("WEIGHT", *weight, "1 to 100; twice the weight, twice the jobs")
      ->required()
      ->check(CLI::Range(1, 100));
}

}  // namespace color3d::client
