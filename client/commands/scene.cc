#include <fmt/core.h>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/photos/mask_files.h"
#include "client/lib/progress_display.h"
#include "client/lib/scene_upload.h"
#include "client/lib/text.h"
#include "core/base/error.h"
#include "core/catalogue/captures.h"

namespace color3d::client {
namespace {

std::string LayoutName(v1::Scene::Layout layout) {
  const auto known = static_cast<CaptureLayout>(layout);
  for (const CaptureLayoutInfo& info : CaptureLayouts()) {
    if (info.layout == known) return info.name;
  }
  return std::to_string(layout);  // of a newer server
}

std::string SceneState(const v1::Scene& scene) {
  return scene.state() == v1::Scene::STATE_ACTIVE ? "ACTIVE" : "UPLOADING";
}

ExitCode RunCreate(const Context& context,
                   const std::string& photos,
                   const std::string& masks,
                   bool film) {
  PhotoFolder folder = CollectPhotos(photos, film);
  if (film && !masks.empty()) {
    throw InvalidArgument("--masks cannot be combined with --film: frames of a film have no masks");
  }
  if (film) UsePhotosAsFrames(&folder);
  if (!masks.empty()) AddMasks(masks, &folder);
  for (const std::string& note : folder.notes) PrintNote(context, note);
  Connection connection(context.server, *context.interrupt);
  ProgressDisplay display(context.json);
  const auto entries = BuildManifest(folder, MaxFileBytes(connection), *context.interrupt);
  const v1::Scene scene =
      UploadScene(connection, entries, folder.Name(), [&](int64_t done, int64_t total) {
        display.OnTransfer("uploading", done, total);
      });
  display.Clear();
  return PrintAnswer(context, scene, scene.name() + "\n");
}

ExitCode RunList(const Context& context, int limit) {
  Connection connection(context.server, *context.interrupt);
  v1::ListScenesResponse all;
  v1::ListScenesRequest request;
  do {
    request.set_page_size(std::min(1000, limit - all.scenes_size()));
    auto page = connection.Call(&v1::SceneService::Stub::ListScenes, connection.scenes(), request);
    all.mutable_scenes()->MergeFrom(page.scenes());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty() && all.scenes_size() < limit);
  std::vector<std::vector<std::string>> rows = {
      {"SCENE", "STATE", "LAYOUT", "PHOTOS", "CREATED (UTC)", "FOLDER"}};
  for (const v1::Scene& scene : all.scenes()) {
    rows.push_back({scene.name(),
                    SceneState(scene),
                    LayoutName(scene.layout()),
                    std::to_string(scene.photo_count()),
                    HumanTime(scene.create_time()),
                    scene.display_name()});
  }
  return PrintAnswer(context, all, Table(rows));
}

ExitCode RunShowScene(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  const v1::Scene scene = GetScene(connection, ResourceName(name, "scenes"));
  std::vector<std::vector<std::string>> rows = {{"FILE", "SIZE"}};
  for (const v1::SceneFile& file : scene.files()) {
    rows.push_back({file.path(), HumanBytes(file.digest().size_bytes())});
  }
  return PrintAnswer(
      context,
      scene,
      fmt::format("{}\nstate    {}\nlayout   {}\nphotos   {}\nfolder   {}\ncreated  {}\n{}",
                  scene.name(),
                  SceneState(scene),
                  LayoutName(scene.layout()),
                  scene.photo_count(),
                  scene.display_name(),
                  HumanTime(scene.create_time()),
                  Table(rows)));
}

ExitCode RunDeleteScene(const Context& context, const std::string& name) {
  Connection connection(context.server, *context.interrupt);
  v1::DeleteSceneRequest request;
  request.set_name(ResourceName(name, "scenes"));
  request.set_request_id(NewUuid());
  return PrintAnswer(
      context,
      connection.Call(&v1::SceneService::Stub::DeleteScene, connection.scenes(), request),
      "deleted " + request.name() + "\n");
}

}  // namespace

void AddSceneCommands(CLI::App& app, Context& context) {
  CLI::App* scene = app.add_subcommand("scene", "Upload, list, show and delete scenes");
  scene->require_subcommand(1)->fallthrough();
  const auto text = std::make_shared<std::string>();
  const auto limit = std::make_shared<int>(50);

  const auto masks = std::make_shared<std::string>();
  const auto film = std::make_shared<bool>(false);
  CLI::App* create = AddCommand(
      *scene,
      context,
      "create",
      "Upload a folder of photos, a splat or a film",
      [&context, text, masks, film] { return RunCreate(context, *text, *masks, *film); });
  create
      ->add_option(
          "PHOTOS", *text, "Folder of photos, a splat (.ply, .sog, .spz), or a film (.mp4, ...)")
      ->required();
  create->add_option("--masks",
                     *masks,
                     "Folder of PNG masks named like the photos: white is used, black is ignored");
  create->add_flag("--film", *film, "Treat the photos as frames of a film");

  AddCommand(*scene,
             context,
             "list",
             "List scenes, newest first",
             [&context, limit] { return RunList(context, *limit); })
      ->add_option("--limit", *limit, "Maximum number of entries")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();

  AddCommand(*scene,
             context,
             "show",
             "Show a scene with its files",
             [&context, text] { return RunShowScene(context, *text); })
      ->add_option("NAME", *text, "scenes/ID")
      ->required();

  AddCommand(*scene,
             context,
             "delete",
             "Delete a scene",
             [&context, text] { return RunDeleteScene(context, *text); })
      ->add_option("NAME", *text, "scenes/ID")
      ->required();
}

}  // namespace color3d::client
