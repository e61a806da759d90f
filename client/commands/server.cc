#include <fmt/format.h>
#include <google/protobuf/text_format.h>

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
  std::string takes;
  for (const std::string& capability : backend.capabilities()) {
    takes += (takes.empty() ? "" : ", ") + capability;
  }
  if (!takes.empty()) text += ", takes " + takes;
  if (backend.max_pixels() > 0) {
    text += fmt::format(", up to {} pixels", backend.max_pixels());
  }
  return text + "\n";
}

std::string Describe(const v1::ServerInfo& info) {
  std::string kinds;
  for (const std::string& kind : info.job_kinds()) kinds += (kinds.empty() ? "" : ", ") + kind;
  std::string text = fmt::format(
      "version    {}{}\nmemory     {}\ndisk free  {}\njobs       {} running, {} queued\n"
      "kinds      {}\n",
      info.version(),
      info.draining() ? " (draining)" : "",
      HumanBytes(info.memory_bytes()),
      HumanBytes(info.disk_free_bytes()),
      info.running_jobs(),
      info.queued_jobs(),
      kinds);
  for (const v1::ModelInfo& model : info.models()) text += DescribeModel(model);
  for (const v1::BackendStatus& backend : info.backends()) text += DescribeBackend(backend);
  for (const v1::WorkerInfo& worker : info.workers()) {
    text += fmt::format("worker     {}, pid {}, {}, {}, heard of {} ago\n",
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
  const auto info = connection.Call(
      &v1::ServerService::Stub::GetServerInfo, connection.server(), v1::GetServerInfoRequest());
  if (context.json) {
    PrintJson(info);
  } else {
    PrintText(Describe(info));
  }
  return ExitCode::kOk;
}

ExitCode RunServerPresets(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  const auto info = connection.Call(
      &v1::ServerService::Stub::GetServerInfo, connection.server(), v1::GetServerInfoRequest());
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

}  // namespace

void AddServerCommands(CLI::App& app, Context& context) {
  CLI::App* server = app.add_subcommand("server", "The server itself")->require_subcommand(1);
  server->fallthrough();
  server->add_subcommand("info", "Version, job kinds, workers, memory")
      ->fallthrough()
      ->callback([&context] { context.action = [&context] { return RunServerInfo(context); }; });
  const auto name = std::make_shared<std::string>();
  CLI::App* presets = server->add_subcommand(
      "presets",
      "What the presets mean, as text: the form that `color3d colorize --preset FILE` reads");
  presets->add_option("NAME", *name, "Only this one");
  presets->fallthrough()->callback([&context, name] {
    context.action = [&context, name] { return RunServerPresets(context, *name); };
  });
}

}  // namespace color3d::client
