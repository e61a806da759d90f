#include "client/commands/benchmark.h"

#include <fmt/core.h>

#include <map>
#include <nlohmann/json.hpp>

#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "client/lib/photos/gray_copies.h"
#include "client/lib/scene_upload.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace {

constexpr int kPhotosToLookAt = 5;
constexpr size_t kMinPhotos = 3;

struct BenchmarkView {
  std::string name;
  std::string image_file;  // path in the scene
  bool held_out = false;
};

std::vector<BenchmarkView> ParseViews(const std::string& scene_json) {
  try {
    std::vector<BenchmarkView> views;
    const auto json = nlohmann::json::parse(scene_json);
    for (const auto& view : json.at("views")) {
      views.push_back({view.at("name"), view.at("image_file"), view.at("held_out")});
    }
    return views;
  } catch (const nlohmann::json::exception& e) {
    throw Error(
        ErrorCode::kDataLoss, "{} from the server cannot be read: {}", artifact::kScene, e.what());
  }
}

std::string ParseKeyView(const std::string& key_view_json) {
  try {
    return nlohmann::json::parse(key_view_json).at("view");
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorCode::kDataLoss,
                "{} from the server cannot be read: {}",
                artifact::kKeyView,
                e.what());
  }
}

struct Selection {
  std::vector<BenchmarkView> views;
  std::string key_view;
};

Selection SelectKeyView(Connection& connection,
                        const Context& context,
                        const ColorizeOptions& options,
                        const std::string& scene,
                        ProgressDisplay& display) {
  const v1::Job import_job = SubmitJob(connection, ImportSpec(options, scene));
  v1::JobSpec spec = SelectSpec(connection, options, scene);
  spec.add_inputs(import_job.name());
  const v1::Job select_job = SubmitJob(connection, spec);
  if (!Follow(connection, {import_job.name(), select_job.name()}, context, display)) {
    throw CommandFailure(ExitCode::kDetached,
                         "interrupted before the benchmark's colouring was submitted; run the same "
                         "command again (finished stages are not repeated)");
  }
  const v1::Job imported = GetJob(connection, import_job.name());
  RequireSuccess(connection, context, imported);
  const v1::Job selected = GetJob(connection, select_job.name());
  RequireSuccess(connection, context, selected);
  return {ParseViews(ReadArtifact(connection, imported, artifact::kScene)),
          ParseKeyView(ReadArtifact(connection, selected, artifact::kKeyView))};
}

// The originals of the key view and of the views that are scored against, as the scene's options.
// Returns the files to upload.
std::vector<UploadFile> AddTrueColors(const ColorizeOptions& options,
                                      const PhotoFolder& folder,
                                      const GrayCopies& copies,
                                      const Selection& selection,
                                      v1::ColorizeSceneSpec* colorize) {
  std::map<std::string, const LocalFile*> originals;
  for (const LocalFile& photo : folder.photos) originals[photo.path] = &photo;
  std::vector<UploadFile> uploads;
  for (const BenchmarkView& view : selection.views) {
    const auto original = originals.find(view.image_file);
    const bool is_key = view.name == selection.key_view && !options.color.Given();
    const bool is_bound = options.bound && !view.held_out;
    if (original == originals.end() || !(is_key || is_bound || view.held_out)) continue;
    if (!copies.in_color.contains(view.image_file)) {
      if (view.held_out) continue;  // nothing to score against
      if (is_key) {
        throw InvalidArgument(
            "the key view {} is monochrome itself; choose one in colour with --key-view",
            view.name);
      }
      throw InvalidArgument(
          "{} is monochrome itself; --bound needs the true colours of all views: leave it out",
          view.name);
    }
    uploads.push_back({original->second->file, DigestFile(original->second->file)});
    const v1::Digest digest = ToProto(uploads.back().digest);
    if (is_key) *colorize->mutable_key_color()->mutable_image() = digest;
    if (!view.held_out && !is_bound) continue;
    v1::TruthImage* truth = view.held_out ? colorize->add_truth() : colorize->add_training_truth();
    truth->set_view(view.name);
    *truth->mutable_image() = digest;
  }
  return uploads;
}

}  // namespace

void RequireColorPhotos(const PhotoFolder& folder, const CancellationToken& cancel) {
  const std::string root = folder.root.string();
  if (folder.photos.size() < kMinPhotos) {
    throw InvalidArgument("{} contains {} photographs; --benchmark needs at least {}",
                          root,
                          folder.photos.size(),
                          kMinPhotos);
  }
  const ColorCount count = CountColorPhotos(folder, kPhotosToLookAt, cancel);
  if (count.MostlyColor()) return;
  throw InvalidArgument(
      "the photographs in {} are monochrome ({} of {} looked at); --benchmark drops the colour of "
      "colour photos and scores against it: leave it out",
      root,
      count.looked_at - count.in_color,
      count.looked_at);
}

v1::JobSpec PrepareBenchmark(Connection& connection,
                             const Context& context,
                             const ColorizeOptions& options,
                             const PhotoFolder& folder,
                             ProgressDisplay& display) {
  const ScratchFolder scratch;
  display.Say(fmt::format("benchmark: dropping the colour of {} photos", folder.photos.size()));
  const GrayCopies copies = MakeGrayCopies(folder, scratch.path(), *context.interrupt);
  const v1::Scene scene = UploadScene(
      connection,
      BuildManifest(copies.folder, *context.interrupt),
      std::filesystem::absolute(folder.root).filename().string() + " (grey)",
      [&](int64_t done, int64_t total) { display.OnTransfer("uploading", done, total); });
  const Selection selection = SelectKeyView(connection, context, options, scene.name(), display);

  v1::JobSpec spec = ColorizeSpec(options, scene.name());
  v1::ColorizeSceneSpec* colorize = spec.mutable_colorize_scene();
  colorize->set_key_view(selection.key_view);
  if (options.color.Given()) {
    *colorize->mutable_key_color() = UploadKeyColor(connection, options.color);
  }
  AddMoreKeys(connection, options, colorize);
  const auto uploads = AddTrueColors(options, folder, copies, selection, colorize);
  UploadMissing(connection, uploads, [&](int64_t done, int64_t total) {
    display.OnTransfer("uploading true colours", done, total);
  });
  display.Say(fmt::format(
      "key view {}; {} views are held out and scored", selection.key_view, colorize->truth_size()));
  return spec;
}

}  // namespace color3d::client
