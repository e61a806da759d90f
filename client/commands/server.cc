#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/text.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

std::string DescribeModel(const v1::ModelInfo& model) {
  std::string text = "model      " + model.name() + ", ";
  if (!model.problem().empty()) return text + model.problem() + "\n";
  return text + model.kind() + ", " + HumanBytes(model.size_bytes()) + ", sha256 " +
         model.sha256().substr(0, 12) + "\n";
}

std::string DescribeBackend(const v1::BackendStatus& backend) {
  std::string text = fmt::format("backend    {} at {}, {}",
                                 backend.name(),
                                 backend.address(),
                                 backend.ready() ? "ready" : backend.problem());
  if (!backend.description().empty()) text += ", " + backend.description();
  if (!backend.capabilities().empty()) {
    text += fmt::format(", takes {}", fmt::join(backend.capabilities(), ", "));
  }
  if (backend.max_pixels() > 0) {
    text += fmt::format(", up to {} pixels", backend.max_pixels());
  }
  return text + "\n";
}

std::string UsageOfLimit(const std::string& used, const std::string& limit, bool is_limited) {
  return is_limited ? used + " of " + limit : used;
}

std::string DescribeUsage(const v1::ProjectUsage& usage,
                          const std::string& label,
                          const std::string& role) {
  return fmt::format("{} {}{}, {} stored, {} jobs unfinished{}\n",
                     label,
                     role.empty() ? "" : role + " in ",
                     usage.project().empty() ? "no project" : "the project " + usage.project(),
                     UsageOfLimit(HumanBytes(usage.stored_bytes()),
                                  HumanBytes(usage.max_stored_bytes()),
                                  usage.max_stored_bytes() > 0),
                     UsageOfLimit(fmt::to_string(usage.unfinished_jobs()),
                                  fmt::to_string(usage.max_unfinished_jobs()),
                                  usage.max_unfinished_jobs() > 0),
                     usage.weight() > 1 ? fmt::format(", weight {}", usage.weight()) : "");
}

std::string Describe(const v1::ServerInfo& info) {
  std::string text = fmt::format(
      "version    {}{}\nmemory     {}\ndisk free  {}\njobs       {} running, {} queued\n"
      "kinds      {}\n",
      info.version(),
      info.draining() ? " (draining)" : "",
      HumanBytes(info.memory_bytes()),
      HumanBytes(info.disk_free_bytes()),
      info.running_jobs(),
      info.queued_jobs(),
      fmt::join(info.job_kinds(), ", "));
  if (!info.waits_for().empty()) text += "queue      waits for: " + info.waits_for() + "\n";
  text += DescribeUsage(info.usage(), "you are   ", info.role());
  for (const v1::ModelInfo& model : info.models()) text += DescribeModel(model);
  for (const v1::BackendStatus& backend : info.backends()) text += DescribeBackend(backend);
  for (const v1::WorkerInfo& worker : info.workers()) {
    text += fmt::format("worker     {}, pid {}, {}, {}, last seen {} ago\n",
                        worker.worker_id(),
                        worker.pid(),
                        HumanBytes(worker.memory_bytes()),
                        worker.job().empty() ? "idle" : "works on " + worker.job(),
                        HumanSeconds(worker.heartbeat_age_seconds()));
  }
  return text;
}

ExitCode RunServerInfo(const Context& context) {
  Connection connection(context.server, *context.interrupt);
  const v1::ServerInfo info = GetServerInfo(connection);
  return PrintAnswer(context, info, Describe(info));
}

ExitCode RunServerPresets(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  const v1::ServerInfo info = GetServerInfo(connection);
  v1::ServerInfo asked_for;
  std::string known;
  for (const v1::PresetInfo& preset : info.presets()) {
    known += (known.empty() ? "" : ", ") + preset.name();
    if (name.empty() || name == preset.name()) *asked_for.add_presets() = preset;
  }
  if (asked_for.presets().empty()) {
    throw Error(ErrorCode::kNotFound, "the server has no preset '{}'; it has {}", name, known);
  }
  if (context.json) {
    nlohmann::ordered_json presets = nlohmann::ordered_json::array();
    for (const v1::PresetInfo& preset : asked_for.presets()) presets.push_back(ToJson(preset));
    PrintJson({{"presets", presets}});
    return ExitCode::kOk;
  }
  std::string text;
  for (const v1::PresetInfo& preset : asked_for.presets()) {
    std::string options;
    google::protobuf::TextFormat::PrintToString(preset.options(), &options);
    text += fmt::format("{}# {}\n{}", text.empty() ? "" : "\n", preset.name(), options);
  }
  PrintText(text);
  return ExitCode::kOk;
}

// Calls an RPC of AdminService without a result and prints `done`.
template <typename Request, typename Response>
ExitCode RunAdmin(const Context& context,
                  grpc::Status (v1::AdminService::Stub::*method)(grpc::ClientContext*,
                                                                 const Request&,
                                                                 Response*),
                  const std::string& done) {
  Connection connection(context.server, *context.interrupt);
  return PrintAnswer(context, connection.Call(method, connection.admin(), Request()), done + "\n");
}

ExitCode RunCollect(const Context& context, const v1::CollectRequest& request) {
  Connection connection(context.server, *context.interrupt);
  const v1::CollectResponse gone = connection.Call(
      &v1::AdminService::Stub::Collect, connection.admin(), request, std::chrono::minutes(10));
  return PrintAnswer(context,
                     gone,
                     fmt::format("{} unreferenced blobs ({}) {}\n",
                                 gone.blobs(),
                                 HumanBytes(gone.bytes()),
                                 request.dry_run() ? "would be removed" : "were removed"));
}

ExitCode RunProjects(const Context& context) {
  Connection connection(context.server, *context.interrupt);
  const v1::ListProjectsResponse all = connection.Call(
      &v1::AdminService::Stub::ListProjects, connection.admin(), v1::ListProjectsRequest());
  std::string text;
  for (const v1::ProjectUsage& usage : all.projects()) text += DescribeUsage(usage, "-", "");
  return PrintAnswer(context, all, text);
}

void AddAdminCommands(CLI::App* server, Context& context) {
  const auto add = [&](const char* name, const char* help, std::function<ExitCode()> run) {
    return AddCommand(*server, context, name, help, std::move(run));
  };
  using Admin = v1::AdminService::Stub;
  add("pause", "Pause the queue: running jobs continue, no job starts (role admin)", [&context] {
    return RunAdmin(context, &Admin::PauseQueue, "the queue is paused");
  });
  add("resume", "Resume the queue (role admin)", [&context] {
    return RunAdmin(context, &Admin::ResumeQueue, "the queue is resumed");
  });
  add("drain", "Save running jobs and stop the server, as SIGTERM does (role admin)", [&context] {
    return RunAdmin(context, &Admin::Drain, "the server drains and stops");
  });
  add("projects", "Show the usage of each project (role admin)", [&context] {
    return RunProjects(context);
  });
  const auto dry_run = std::make_shared<bool>(false);
  const auto hours = std::make_shared<int>(24);
  CLI::App* collect =
      add("collect", "Remove unreferenced blobs (role admin)", [&context, dry_run, hours] {
        v1::CollectRequest collect_request;
        collect_request.set_dry_run(*dry_run);
        collect_request.set_grace_seconds(int64_t{3600} * *hours);
        return RunCollect(context, collect_request);
      });
  collect->add_flag("--dry-run", *dry_run, "Only count the blobs");
  collect->add_option("--hours", *hours, "Minimum time without a reference, h")
      ->check(CLI::Range(1, 24 * 365))
      ->capture_default_str();
}

}  // namespace

void AddServerCommands(CLI::App& app, Context& context) {
  CLI::App* server =
      app.add_subcommand("server", "Show and manage the server")->require_subcommand(1);
  server->fallthrough();
  AddCommand(*server, context, "info", "Show version, job kinds, workers and memory", [&context] {
    return RunServerInfo(context);
  });
  AddAdminCommands(server, context);
  AddQueueCommands(*server, context);
  const auto name = std::make_shared<std::string>();
  AddCommand(*server,
             context,
             "presets",
             "Print the options of the presets, in the format of `color3d colorize --preset FILE`",
             [&context, name] { return RunServerPresets(context, *name); })
      ->add_option("NAME", *name, "Only this preset");
}

}  // namespace color3d::client
