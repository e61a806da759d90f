// `color3d colorizer`: list, show and apply personalized colorizers.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/live_files.h"
#include "client/commands/results.h"
#include "client/lib/live_coloring.h"
#include "client/lib/names.h"
#include "client/lib/text.h"

namespace color3d::client {
namespace {

struct ColorizerOptions {
  std::string name;   // colorizers/... or scenes/...
  std::string scene;  // for list
  int limit = 100;
  std::vector<std::string> photos;
  std::string out = "colored";
  LiveOptions live;
};

ExitCode List(const Context& context, const ColorizerOptions& options) {
  Connection connection(context.server, *context.interrupt);
  v1::ListColorizersResponse all;
  v1::ListColorizersRequest request;
  if (!options.scene.empty()) request.set_scene(ResourceName(options.scene, "scenes"));
  do {
    request.set_page_size(std::min(1000, options.limit - all.colorizers_size()));
    const auto page = connection.Call(
        &v1::ColorizerService::Stub::ListColorizers, connection.colorizers(), request);
    all.mutable_colorizers()->MergeFrom(page.colorizers());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty() && all.colorizers_size() < options.limit);
  std::vector<std::vector<std::string>> rows = {{"COLORIZER", "SCENE", "SIZE", "MADE"}};
  for (const v1::Colorizer& colorizer : all.colorizers()) {
    rows.push_back({colorizer.name(),
                    colorizer.scene(),
                    HumanBytes(colorizer.file().size_bytes()),
                    HumanTime(colorizer.create_time())});
  }
  return PrintAnswer(context, all, Table(rows));
}

ExitCode Show(const Context& context, const ColorizerOptions& options) {
  Connection connection(context.server, *context.interrupt);
  v1::GetColorizerRequest request;
  request.set_name(ResourceName(options.name, "colorizers"));
  const v1::Colorizer colorizer =
      connection.Call(&v1::ColorizerService::Stub::GetColorizer, connection.colorizers(), request);
  return PrintAnswer(context,
                     colorizer,
                     fmt::format("{}\nscene  {}\njob    {}\nsize   {}\nmade   {}\n",
                                 colorizer.name(),
                                 colorizer.scene(),
                                 colorizer.job(),
                                 HumanBytes(colorizer.file().size_bytes()),
                                 HumanTime(colorizer.create_time())));
}

ExitCode Apply(const Context& context, const ColorizerOptions& options) {
  const std::vector<LivePicture> pictures = CollectPictures(context, options.photos, options.out);
  PrepareOut(options.out);
  Connection connection(context.server, *context.interrupt);
  LiveSource source;
  if (options.name.starts_with("scenes/")) {
    source.scene = options.name;
  } else {
    source.colorizer = ResourceName(options.name, "colorizers");
  }
  return PrintSummary(context,
                      ColorizeToFiles(connection, source, pictures, options.live, options.out),
                      options.out);
}

}  // namespace

void AddColorizerCommands(CLI::App& app, Context& context) {
  CLI::App* group = app.add_subcommand("colorizer", "List, show and apply personalized colorizers")
                        ->require_subcommand(1);
  group->fallthrough();
  const auto options = std::make_shared<ColorizerOptions>();
  const auto command = [&](const char* name,
                           const char* help,
                           ExitCode (*run)(const Context&, const ColorizerOptions&)) {
    return AddCommand(
        *group, context, name, help, [&context, options, run] { return run(context, *options); });
  };
  CLI::App* list = command("list", "List colorizers, newest first", &List);
  list->add_option("--scene", options->scene, "Only colorizers of this scene");
  list->add_option("--limit", options->limit, "Maximum number of entries")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  CLI::App* show = command("show", "Show scene, job, size and time of a colorizer", &Show);
  show->add_option("colorizer", options->name, "colorizers/SHA256")->required();
  CLI::App* apply =
      command("apply", "Colour photos with a colorizer at once, without a job", &Apply);
  apply
      ->add_option(
          "colorizer", options->name, "colorizers/SHA256, or scenes/ID for its newest colorizer")
      ->required();
  apply->add_option("photos", options->photos, "Photos, or folders of photos")->required();
  apply->add_option("-o,--out", options->out, "Folder for the coloured pictures")
      ->capture_default_str();
  apply
      ->add_option("--max-side",
                   options->live.max_side_px,
                   "Longer side of the coloured pictures, px; 0: that of the photos")
      ->check(CLI::Range(0, 8192))
      ->capture_default_str();
  apply
      ->add_option(
          "--in-flight",
          options->live.in_flight,
          "Maximum number of photos sent before the first result; 0: the limit of the server")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
}

}  // namespace color3d::client
