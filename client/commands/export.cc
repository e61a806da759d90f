// `color3d export`: writes a coloured scene in other formats, and its pictures with their credit.
#include <fmt/core.h>

#include <algorithm>
#include <memory>

#include "client/commands/colored_scene.h"
#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/commands/scene_products.h"
#include "client/lib/text.h"
#include "client/options/credit_flags.h"
#include "core/base/error.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct ExportFlags {
  std::string target;  // folder of results, jobs/ID or scenes/ID
  std::string out;     // empty: the folder of results
  std::vector<std::string> formats;
  bool pictures = false;
  CreditFlags credit;
};

void CheckExport(const ExportFlags& flags) {
  ExportOf(flags.formats);
  flags.credit.credit.Validate();
  if (flags.formats.empty() && !flags.pictures) {
    throw InvalidArgument("nothing is to be written; give --format NAME, or --pictures");
  }
  if (flags.credit.IsGiven() && !flags.pictures) {
    throw InvalidArgument("a credit is written into pictures; add --pictures");
  }
  if (flags.pictures && flags.out.empty()) {
    throw InvalidArgument("--pictures needs a folder of its own; name one with -o");
  }
}

// Artifacts that are listed, or lie in a listed folder.
std::vector<v1::Artifact> Listed(const v1::Job& job, const std::vector<std::string>& names) {
  std::vector<v1::Artifact> listed;
  for (const v1::Artifact& artifact : job.artifacts()) {
    const bool is_listed = std::ranges::any_of(names, [&](const std::string& name) {
      return artifact.name() == name || (name.ends_with('/') && artifact.name().starts_with(name));
    });
    if (is_listed) listed.push_back(artifact);
  }
  return listed;
}

ExitCode RunExport(const Context& context, const ExportFlags& flags) {
  CheckExport(flags);
  const fs::path out = !flags.out.empty()         ? flags.out
                       : IsOnServer(flags.target) ? "."
                                                  : flags.target;
  Connection connection(context.server, *context.interrupt);
  const v1::Job of = FindColoredScene(connection, flags.target);
  PrepareOut(out);
  ProgressDisplay display(context.json);
  std::vector<std::string> files;
  const auto fetch = [&](const std::vector<v1::Artifact>& artifacts) {
    const auto names = DownloadArtifacts(connection, artifacts, out, display);
    files.insert(files.end(), names.begin(), names.end());
  };
  if (!flags.formats.empty()) {
    v1::JobSpec spec = SpecOn(connection, of);
    *spec.mutable_export_() = ExportOf(flags.formats);
    const v1::Job submitted = SubmitJob(connection, spec);
    const v1::Job made =
        FollowToSuccess(connection, context, {submitted.name()}, out.string(), display);
    fetch(Listed(made, ArtifactsOfFormats(flags.formats)));
  }
  if (flags.pictures) {
    std::vector<v1::Artifact> pictures;
    std::ranges::copy_if(of.artifacts(), std::back_inserter(pictures), [](const v1::Artifact& a) {
      return IsColoredPicture(a.name());
    });
    fetch(pictures);
    CreditPictures(out, files, flags.credit);
  }
  if (context.json) {
    PrintJson({{"of", of.name()}, {"out", out.string()}, {"files", files}});
    return ExitCode::kOk;
  }
  std::string text;
  for (const std::string& name : files) {
    text += fmt::format("{}  {}\n",
                        (out / name).string(),
                        HumanBytes(static_cast<int64_t>(fs::file_size(out / name))));
  }
  PrintText(text);
  return ExitCode::kOk;
}

}  // namespace

void AddExportCommand(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<ExportFlags>();
  CLI::App* command = AddCommand(app,
                                 context,
                                 "export",
                                 "Write a coloured scene in other formats, and its pictures",
                                 [&context, flags] { return RunExport(context, *flags); });
  command
      ->add_option("RESULTS",
                   flags->target,
                   "Folder of results that `color3d colorize` wrote, or jobs/ID or scenes/ID")
      ->required();
  command->add_option("--format", flags->formats, "ply, sog, spz, glb, splat; dynamic: splat4d")
      ->allow_extra_args(false);
  command->add_flag("--pictures", flags->pictures, "Also its pictures in colour");
  command->add_option("-o,--out", flags->out, "Folder to write to; default: that of the results");
  DeclareCreditFlags(*command, &flags->credit, /*with_caption=*/true);
}

}  // namespace color3d::client
