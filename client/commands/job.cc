#include <fmt/core.h>
#include <google/protobuf/util/json_util.h>

#include <iostream>
#include <iterator>
#include <optional>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/follow.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/text.h"
#include "core/base/files.h"

namespace color3d::client {
namespace {

constexpr int64_t kMaxSpecBytes = 4 << 20;

std::vector<std::string> JobRow(const v1::Job& job) {
  const v1::Progress& progress = job.progress();
  const std::string steps = progress.total_steps() > 0
                                ? fmt::format("{}/{}", progress.step(), progress.total_steps())
                                : "-";
  return {job.name(),
          job.kind(),
          StateName(job.state()) + (job.cached() ? " (cached)" : ""),
          steps,
          HumanSeconds(progress.seconds()),
          HumanTime(job.create_time())};
}

const std::vector<std::string> kJobHeading = {
    "JOB", "KIND", "STATE", "STEP", "SECONDS", "CREATED (UTC)"};

ExitCode PrintJob(const Context& context, const v1::Job& job) {
  return PrintAnswer(
      context, job, fmt::format("{}  {}  {}\n", job.name(), job.kind(), StateName(job.state())));
}

ExitCode RunSubmit(const Context& context, const std::string& file, const Submission& submission) {
  const std::string text = file == "-" ? std::string(std::istreambuf_iterator<char>(std::cin), {})
                                       : ReadFile(file, kMaxSpecBytes);
  v1::JobSpec spec;
  const auto status = google::protobuf::util::JsonStringToMessage(text, &spec);
  if (!status.ok()) {
    throw InvalidArgument("{} is not a JobSpec in JSON: {}", file, std::string(status.message()));
  }
  Connection connection(context.server, *context.interrupt);
  return PrintJob(context, SubmitJob(connection, spec, submission));
}

struct AllInOneArguments {
  std::vector<std::string> scenes;  // scenes/ID, or scenes/ID=jobs/ID with the job of the key view
  std::optional<int> iterations;
  bool again = false;
  Submission submission;
};

ExitCode RunAllInOne(const Context& context, const AllInOneArguments& arguments) {
  v1::JobSpec spec;
  spec.set_skip_cache(arguments.again);
  v1::PersonalizeScenesSpec* scenes = spec.mutable_personalize_scenes();
  for (const std::string& text : arguments.scenes) {
    const size_t equals = text.find('=');
    auto* route = scenes->add_routes();
    route->set_scene(ResourceName(text.substr(0, equals), "scenes"));
    if (equals != std::string::npos) {
      route->set_key_color_job(ResourceName(text.substr(equals + 1), "jobs"));
    }
  }
  if (arguments.iterations) scenes->mutable_options()->set_iterations(*arguments.iterations);
  spec.set_scene(scenes->routes(0).scene());
  Connection connection(context.server, *context.interrupt);
  return PrintJob(context, SubmitJob(connection, spec, arguments.submission));
}

ExitCode RunList(const Context& context, const std::string& parent, int limit) {
  Connection connection(context.server, *context.interrupt);
  v1::ListJobsResponse all;
  v1::ListJobsRequest request;
  request.set_parent(parent);
  do {
    request.set_page_size(std::min(1000, limit - all.jobs_size()));
    auto page = connection.Call(&v1::JobService::Stub::ListJobs, connection.jobs(), request);
    all.mutable_jobs()->MergeFrom(page.jobs());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty() && all.jobs_size() < limit);
  std::vector<std::vector<std::string>> rows = {kJobHeading};
  for (const v1::Job& job : all.jobs()) rows.push_back(JobRow(job));
  return PrintAnswer(context, all, Table(rows));
}

ExitCode RunShow(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  const v1::Job job = GetJob(connection, ResourceName(name, "jobs"));
  if (context.json) {
    PrintJson(job);
    return ExitCode::kOk;
  }
  std::string text = fmt::format(
      "{}\nkind       {}\nscene      {}\nstate      {}{}\nattempt    {} of {}\nartifacts  {}\n",
      job.name(),
      job.kind(),
      job.spec().scene(),
      StateName(job.state()),
      job.cached() ? " (cached)" : "",
      job.attempt(),
      job.max_attempts(),
      job.artifacts_size());
  if (!job.parent().empty()) text += "parent     " + job.parent() + "\n";
  if (job.pinned()) text += "pinned     never deleted by age\n";
  if (job.queue_position() > 0) {
    text += fmt::format("queue      position {}{}\n",
                        job.queue_position(),
                        job.waits_for().empty() ? "" : ", waits for " + job.waits_for());
  }
  if (job.queued_seconds() > 0) {
    text += "waited     " + HumanSeconds(job.queued_seconds()) + " for a worker\n";
  }
  if (job.state() == v1::Job::STATE_RUNNING) text += "progress   " + ProgressLine(job, 200) + "\n";
  if (job.has_error()) text += "error      " + DescribeStatus(job.error()) + "\n";
  if (!job.skip_reason().empty()) text += "left out   " + job.skip_reason() + "\n";
  for (const std::string& warning : job.warnings()) text += "warning    " + warning + "\n";
  const auto children = ListChildren(connection, job.name());
  if (!children.empty()) {
    std::vector<std::vector<std::string>> rows = {kJobHeading};
    for (const v1::Job& child : children) rows.push_back(JobRow(child));
    text += Table(rows);
  }
  PrintText(text);
  return ExitCode::kOk;
}

ExitCode RunWatch(const Context& context, const std::string& text) {
  Connection connection(context.server, *context.interrupt);
  const std::string name = ResourceName(text, "jobs");
  ProgressDisplay display(context.json);
  if (!Follow(connection, {name}, context, display)) {
    throw CommandFailure(
        ExitCode::kDetached,
        fmt::format("detached; {} continues; {}", name, ReattachHint(context, name, "")));
  }
  const v1::Job job = GetJob(connection, name);
  RequireSuccess(connection, context, job);
  return PrintJob(context, job);
}

ExitCode RunCancel(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  return PrintJob(context, CancelJob(connection, ResourceName(name, "jobs")));
}

ExitCode RunRetry(const Context& context, const std::string& name, bool from_scratch) {
  Connection connection(context.server, *context.interrupt);
  v1::RetryJobRequest request;
  request.set_name(ResourceName(name, "jobs"));
  request.set_from_scratch(from_scratch);
  request.set_request_id(NewUuid());
  return PrintJob(context,
                  connection.Call(&v1::JobService::Stub::RetryJob, connection.jobs(), request));
}

ExitCode RunDelete(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  v1::DeleteJobRequest request;
  request.set_name(ResourceName(name, "jobs"));
  request.set_request_id(NewUuid());
  return PrintAnswer(context,
                     connection.Call(&v1::JobService::Stub::DeleteJob, connection.jobs(), request),
                     "deleted " + request.name() + "\n");
}

ExitCode RunPin(const Context& context, const std::string& name, bool pinned) {
  Connection connection(context.server, *context.interrupt);
  v1::PinJobRequest request;
  request.set_name(ResourceName(name, "jobs"));
  request.set_pinned(pinned);
  return PrintJob(context,
                  connection.Call(&v1::JobService::Stub::PinJob, connection.jobs(), request));
}

ExitCode RunKill(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  v1::KillJobRequest request;
  request.set_name(ResourceName(name, "jobs"));
  return PrintJob(context,
                  connection.Call(&v1::AdminService::Stub::KillJob, connection.admin(), request));
}

// Continues at the same position after a lost connection.
ExitCode RunLog(const Context& context, const std::string& name, bool follow) {
  Connection connection(context.server, *context.interrupt);
  v1::ReadJobLogRequest request;
  request.set_name(ResourceName(name, "jobs"));
  request.set_follow(follow);
  Backoff backoff;
  std::string rest;  // start of an incomplete line
  while (true) {
    grpc::ClientContext call;
    const auto stream = connection.jobs().ReadJobLog(&call, request);
    v1::JobLogChunk chunk;
    while (stream->Read(&chunk)) {
      rest += chunk.data();
      const size_t whole = rest.rfind('\n') + 1;  // 0: no complete line
      PrintText(rest.substr(0, whole));
      rest.erase(0, whole);
      request.set_offset(chunk.offset() + static_cast<int64_t>(chunk.data().size()));
      backoff.Reset();
      if (context.interrupt->IsCancelled()) return ExitCode::kDetached;
    }
    const grpc::Status status = stream->Finish();
    if (status.ok()) PrintText(rest);
    if (status.ok()) return ExitCode::kOk;
    const RpcError error(status);
    if (!error.IsTransient() || !backoff.Wait(*context.interrupt, error.RetryDelay())) throw error;
  }
}

// Adds a subcommand of `job` that takes the name of a job.
CLI::App* AddNamed(CLI::App* job,
                   Context& context,
                   const std::string& command,
                   const std::string& help,
                   std::function<ExitCode(const Context&, const std::string&)> run) {
  const auto name = std::make_shared<std::string>();
  CLI::App* app = AddCommand(
      *job, context, command, help, [&context, name, run] { return run(context, *name); });
  app->add_option("NAME", *name, "jobs/ID")->required();
  return app;
}

}  // namespace

void AddJobCommands(CLI::App& app, Context& context) {
  CLI::App* job = app.add_subcommand("job", "Submit, list, follow and manage jobs");
  job->require_subcommand(1)->fallthrough();
  const auto file = std::make_shared<std::string>();
  const auto parent = std::make_shared<std::string>();
  const auto limit = std::make_shared<int>(50);
  const auto from_scratch = std::make_shared<bool>(false);

  CLI::App* submit = job->add_subcommand("submit", "Submit a job");
  submit->fallthrough();
  auto* spec_option =
      submit->add_option("SPEC", *file, "JobSpec as JSON (protobuf mapping); -: standard input");
  const auto all_in_one = std::make_shared<AllInOneArguments>();
  auto* scenes_option =
      submit
          ->add_option(
              "--all-in-one",
              all_in_one->scenes,
              "Personalize these scenes together: scenes/ID, or scenes/ID=jobs/ID with the "
              "job that coloured its key view (default: the accepted one)")
          ->expected(1, 10'000)
          ->excludes(spec_option);
  submit
      ->add_option(
          "--iterations", all_in_one->iterations, "With --all-in-one: iterations for each scene")
      ->needs(scenes_option);
  submit->add_flag("--again", all_in_one->again, "With --all-in-one: ignore the stage cache")
      ->needs(scenes_option);
  AddSubmissionFlags(*submit, &all_in_one->submission);
  submit->callback([&context, file, all_in_one] {
    if (file->empty() && all_in_one->scenes.empty()) {
      throw CLI::RequiredError("SPEC or --all-in-one");
    }
    context.action = [&context, file, all_in_one] {
      return all_in_one->scenes.empty() ? RunSubmit(context, *file, all_in_one->submission)
                                        : RunAllInOne(context, *all_in_one);
    };
  });

  CLI::App* list =
      AddCommand(*job, context, "list", "List jobs, newest first", [&context, parent, limit] {
        return RunList(context, *parent, *limit);
      });
  list->add_option("PARENT", *parent, "Only the stages of jobs/ID, or the jobs of scenes/ID");
  list->add_option("--limit", *limit, "Maximum number of entries")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();

  AddNamed(job, context, "show", "Show a job with its stages", RunShow);
  AddNamed(job, context, "watch", "Follow a job to its end", RunWatch);
  AddNamed(job, context, "cancel", "Cancel a job and its stages", RunCancel);
  AddNamed(job, context, "delete", "Delete a finished job", RunDelete);
  AddNamed(
      job, context, "pin", "Keep a job regardless of its age", [](const auto& c, const auto& name) {
        return RunPin(c, name, true);
      });
  AddNamed(job,
           context,
           "unpin",
           "Allow a job to be deleted by age again",
           [](const auto& c, const auto& name) { return RunPin(c, name, false); });
  AddNamed(job, context, "kill", "Kill a job of any project at once (role admin)", RunKill);
  const auto follow = std::make_shared<bool>(false);
  AddNamed(job,
           context,
           "log",
           "Print the log of a stage (`job show` lists the stages of a job)",
           [follow](const Context& c, const std::string& name) { return RunLog(c, name, *follow); })
      ->add_flag("-f,--follow", *follow, "Follow the log until the job has ended");
  AddNamed(job,
           context,
           "retry",
           "Continue a failed or cancelled job from its last checkpoint",
           [from_scratch](const Context& c, const std::string& name) {
             return RunRetry(c, name, *from_scratch);
           })
      ->add_flag("--from-scratch", *from_scratch, "Start again without the checkpoint");
}

}  // namespace color3d::client
