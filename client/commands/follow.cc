#include "client/commands/follow.h"

#include <fmt/core.h>

#include <set>

#include "client/commands/console.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/text.h"

namespace color3d::client {
namespace {

void PrintWarnings(Connection& connection, const Context& context, const v1::Job& job) {
  for (const std::string& warning : job.warnings()) PrintNote(context, warning);
  for (const v1::Job& child : ListChildren(connection, job.name())) {
    for (const std::string& warning : child.warnings()) {
      PrintNote(context, child.kind() + ": " + warning);
    }
  }
}

}  // namespace

v1::Job SubmitJob(Connection& connection, const v1::JobSpec& spec, const Submission& submission) {
  v1::CreateJobRequest request;
  *request.mutable_spec() = spec;
  request.set_request_id(NewUuid());
  request.set_notify_url(submission.notify);
  if (submission.priority) request.set_priority(*submission.priority);
  if (!submission.deadline.empty()) {
    *request.mutable_deadline() = ParseDeadline(submission.deadline);
  }
  return connection.Call(&v1::JobService::Stub::CreateJob, connection.jobs(), request);
}

std::string CommandLine(const Context& context, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "color3d");
  if (context.server.address != kDefaultServer) {
    arguments.push_back("--server");
    arguments.push_back(context.server.address);
  }
  return ShellLine(arguments);
}

std::string ReattachHint(const Context& context, const std::string& job, const std::string& out) {
  std::string hint = "attach again with `" + CommandLine(context, {"job", "watch", job}) + "`";
  if (!out.empty()) {
    hint += ", fetch the results with `" +
            CommandLine(context, {"artifact", "download", job, "-o", out}) + "`";
  }
  return hint;
}

bool Follow(Connection& connection,
            const std::vector<std::string>& jobs,
            const Context& context,
            ProgressDisplay& display,
            const StageDone& on_stage_done) {
  // Stages of a failed job may still run. Their results are kept, but not waited for.
  std::set<std::string> unfinished(jobs.begin(), jobs.end()), done;
  const auto keep_going = [&] {
    display.OnTick([&] { return GetJob(connection, jobs.back()); });
    return !unfinished.empty() && !context.interrupt->IsCancelled();
  };
  const auto on_event = [&](const v1::JobEvent& event) {
    display.OnEvent(event);
    if (IsFinished(event.job().state())) unfinished.erase(event.job().name());
    if (on_stage_done && event.job().state() == v1::Job::STATE_SUCCEEDED &&
        done.insert(event.job().name()).second) {
      on_stage_done(event.job());
    }
  };
  try {
    const WatchEnd end = WatchJobs(connection, jobs, on_event, keep_going);
    display.Clear();
    return end == WatchEnd::kFinished || unfinished.empty();
  } catch (const Error& e) {
    if (e.code() != ErrorCode::kUnavailable) throw;
    display.Clear();
    throw CommandFailure(
        ExitCode::kUnreachable,
        fmt::format("lost the server at {}; accepted jobs continue when it is back: {}",
                    connection.address(),
                    ReattachHint(context, jobs.back(), "")));
  }
}

void RequireSuccess(Connection& connection, const Context& context, const v1::Job& job) {
  if (job.state() == v1::Job::STATE_SUCCEEDED) return;
  if (job.state() == v1::Job::STATE_CANCELLED) {
    throw CommandFailure(ExitCode::kJobFailed,
                         fmt::format("{} was cancelled; `{}` continues it",
                                     job.name(),
                                     CommandLine(context, {"job", "retry", job.name()})));
  }
  // The failed stage: the first failed child, or the job itself.
  v1::Job blamed = job;
  for (const v1::Job& child : ListChildren(connection, job.name())) {
    if (child.state() != v1::Job::STATE_FAILED) continue;
    blamed = child;
    break;
  }
  std::string reason = blamed.error().message();
  if (reason.empty()) reason = blamed.skip_reason();
  if (reason.empty()) reason = "it is " + StateName(blamed.state());
  const ExitCode code = ExitCodeOf(blamed);
  std::string message =
      "the stage " + StageName(blamed) + " failed (" + blamed.name() + "): " + reason;
  if (code == ExitCode::kJobFailed) {
    message += "; `" + CommandLine(context, {"job", "retry", job.name()}) +
               "` continues from its last checkpoint";
  }
  throw CommandFailure(code == ExitCode::kOk ? ExitCode::kJobFailed : code, message);
}

v1::Job FollowToSuccess(Connection& connection,
                        const Context& context,
                        const std::vector<std::string>& jobs,
                        const std::string& out,
                        ProgressDisplay& display,
                        const StageDone& on_stage_done) {
  if (!Follow(connection, jobs, context, display, on_stage_done)) {
    throw CommandFailure(
        ExitCode::kDetached,
        fmt::format(
            "detached; {} continues; {}", jobs.back(), ReattachHint(context, jobs.back(), out)));
  }
  v1::Job job;
  for (const std::string& name : jobs) {
    job = GetJob(connection, name);
    RequireSuccess(connection, context, job);
    if (!context.json) PrintWarnings(connection, context, job);
  }
  return job;
}

}  // namespace color3d::client
