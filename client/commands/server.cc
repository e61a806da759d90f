#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/text.h"

namespace color3d::client {
namespace {

std::string DescribeModel(const v1::ModelInfo& model) {
  std::string text = "model      " + model.name() + ", ";
  if (!model.problem().empty()) return text + model.problem() + "\n";
  return text + model.kind() + ", " + HumanBytes(model.size_bytes()) + ", sha256 " +
         model.sha256().substr(0, 12) + "\n";
}

std::string DescribeBackend(const v1::BackendStatus& backend) {
  std::string text = "backend    " + backend.name() + " at " + backend.address() + ", " +
                     (backend.ready() ? "ready" : backend.problem());
  if (!backend.description().empty()) text += ", " + backend.description();
  std::string takes;
  for (const std::string& capability : backend.capabilities()) {
    takes += (takes.empty() ? "" : ", ") + capability;
  }
  if (!takes.empty()) text += ", takes " + takes;
  if (backend.max_pixels() > 0) {
    text += ", up to " + std::to_string(backend.max_pixels()) + " pixels";
  }
  return text + "\n";
}

std::string Describe(const v1::ServerInfo& info) {
  std::string kinds;
  for (const std::string& kind : info.job_kinds()) kinds += (kinds.empty() ? "" : ", ") + kind;
  std::string text = "version    " + info.version() + (info.draining() ? " (draining)" : "") +
                     "\nmemory     " + HumanBytes(info.memory_bytes()) + "\ndisk free  " +
                     HumanBytes(info.disk_free_bytes()) + "\njobs       " +
                     std::to_string(info.running_jobs()) + " running, " +
                     std::to_string(info.queued_jobs()) + " queued\nkinds      " + kinds + "\n";
  for (const v1::ModelInfo& model : info.models()) text += DescribeModel(model);
  for (const v1::BackendStatus& backend : info.backends()) text += DescribeBackend(backend);
  for (const v1::WorkerInfo& worker : info.workers()) {
    text += "worker     " + worker.worker_id() + ", pid " + std::to_string(worker.pid()) + ", " +
            HumanBytes(worker.memory_bytes()) + ", " +
            (worker.job().empty() ? "idle" : "works on " + worker.job()) + ", heard of " +
            HumanSeconds(worker.heartbeat_age_seconds()) + " ago\n";
  }
  return text;
}

ExitCode RunServerInfo(const Context& context) {
  Connection connection(context.server, *context.interrupt);
  const auto info = connection.Call(
      &v1::ServerService::Stub::GetServerInfo, connection.server(), v1::GetServerInfoRequest());
  if (context.json) {
    PrintJson(info);
  } else {
    PrintText(Describe(info));
  }
  return ExitCode::kOk;
}

}  // namespace

void AddServerCommands(CLI::App& app, Context& context) {
  CLI::App* server = app.add_subcommand("server", "The server itself")->require_subcommand(1);
  server->fallthrough();
  server->add_subcommand("info", "Version, job kinds, workers, memory")
      ->fallthrough()
      ->callback([&context] { context.action = [&context] { return RunServerInfo(context); }; });
}

}  // namespace color3d::client
