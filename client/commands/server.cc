#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/text.h"

namespace color3d::client {
namespace {

std::string Describe(const v1::ServerInfo& info) {
  std::string kinds;
  for (const std::string& kind : info.job_kinds()) kinds += (kinds.empty() ? "" : ", ") + kind;
  std::string text = "version    " + info.version() + (info.draining() ? " (draining)" : "") +
                     "\nmemory     " + HumanBytes(info.memory_bytes()) + "\ndisk free  " +
                     HumanBytes(info.disk_free_bytes()) + "\njobs       " +
                     std::to_string(info.running_jobs()) + " running, " +
                     std::to_string(info.queued_jobs()) + " queued\nkinds      " + kinds + "\n";
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
