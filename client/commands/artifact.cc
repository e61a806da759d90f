#include <fmt/core.h>

#include <algorithm>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/results.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/text.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace {

struct ArtifactOptions {
  std::string job;
  std::string name;  // empty: all
  std::string out;
};

ExitCode RunList(const Context& context, const ArtifactOptions& options) {
  Connection connection(context.server, *context.interrupt);
  const v1::Job job = GetJob(connection, ResourceName(options.job, "jobs"));
  if (context.json) {
    nlohmann::ordered_json artifacts = nlohmann::ordered_json::array();
    for (const v1::Artifact& artifact : job.artifacts()) artifacts.push_back(ToJson(artifact));
    PrintJson({{"job", job.name()}, {"artifacts", artifacts}});
    return ExitCode::kOk;
  }
  std::vector<std::vector<std::string>> rows = {{"NAME", "SIZE", "TYPE"}};
  for (const v1::Artifact& artifact : job.artifacts()) {
    rows.push_back(
        {artifact.name(), HumanBytes(artifact.digest().size_bytes()), artifact.media_type()});
  }
  PrintText(Table(rows));
  return ExitCode::kOk;
}

ExitCode RunDownload(const Context& context, const ArtifactOptions& options) {
  Connection connection(context.server, *context.interrupt);
  const v1::Job job = GetJob(connection, ResourceName(options.job, "jobs"));
  std::vector<v1::Artifact> artifacts(job.artifacts().begin(), job.artifacts().end());
  if (!options.name.empty()) artifacts = {FindArtifact(job, options.name)};
  if (artifacts.empty()) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} has no artifacts: it is {}; a job has them once it has succeeded",
                job.name(),
                StateName(job.state()));
  }
  PrepareOut(options.out);
  ProgressDisplay display(context.json);
  const auto names = DownloadArtifacts(connection, artifacts, options.out, display);
  if (context.json) {
    PrintJson({{"job", job.name()}, {"out", options.out}, {"files", names}});
  } else {
    PrintText(fmt::format("{}{} in {}\n{}",
                          names.size(),
                          names.size() == 1 ? " file" : " files",
                          options.out,
                          options.name.empty() ? Summary(options.out) : ""));
  }
  return ExitCode::kOk;
}

}  // namespace

void AddArtifactCommands(CLI::App& app, Context& context) {
  CLI::App* artifact = app.add_subcommand("artifact", "List and download the results of jobs");
  artifact->require_subcommand(1)->fallthrough();
  const auto options = std::make_shared<ArtifactOptions>();

  AddCommand(*artifact,
             context,
             "list",
             "List the results of a job with their sizes",
             [&context, options] { return RunList(context, *options); })
      ->add_option("JOB", options->job, "jobs/ID")
      ->required();

  CLI::App* download = AddCommand(
      *artifact, context, "download", "Download one result of a job, or all", [&context, options] {
        return RunDownload(context, *options);
      });
  download->add_option("JOB", options->job, "jobs/ID")->required();
  download->add_option("NAME",
                       options->name,
                       fmt::format("Name of the result, e.g. {}; default: all", artifact::kPly));
  download->add_option("-o,--out", options->out, "Folder to write to")->required();
}

}  // namespace color3d::client
