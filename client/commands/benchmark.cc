#include "client/commands/benchmark.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "client/commands/follow.h"
#include "client/commands/results.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "client/lib/names.h"
#include "client/lib/photos/gray_copies.h"
#include "client/lib/scene_upload.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"

namespace color3d::client {
namespace {

constexpr int kInspectedPhotos = 5;
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

// Returns the key views in the order in which they were chosen.
std::vector<std::string> ParseKeyViews(const std::string& key_view_json) {
  try {
    const auto json = nlohmann::json::parse(key_view_json);
    std::vector<std::string> names;
    for (const auto& chosen : json.value("key_views", nlohmann::json::array())) {
      names.push_back(chosen.at("view"));
    }
    return names.empty() ? std::vector<std::string>{json.at("view")} : names;
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorCode::kDataLoss,
                "{} from the server cannot be read: {}",
                artifact::kKeyView,
                e.what());
  }
}

struct Selection {
  std::vector<BenchmarkView> views;
  std::vector<std::string> key_views;  // in the order in which they were chosen

  bool IsKey(const std::string& view) const {
    return std::ranges::find(key_views, view) != key_views.end();
  }
};

Selection SelectKeyView(Connection& connection,
                        const Context& context,
                        const ColorizeOptions& options,
                        const std::string& scene,
                        ProgressDisplay& display) {
  const v1::Job import_job = SubmitJob(connection, ImportSpec(options, scene));
  std::vector<std::string> jobs = {import_job.name()};
  v1::JobSpec spec = SelectSpec(connection, options, scene);
  spec.add_inputs(import_job.name());
  // Several key views are chosen by their geometry, which a time budget would change.
  if (options.keys > 1 && options.time_budget_seconds == 0.0) {
    v1::JobSpec geometry = GeometrySpec(connection, options, scene);
    geometry.add_inputs(import_job.name());
    jobs.push_back(SubmitJob(connection, geometry).name());
    spec.add_inputs(jobs.back());
  }
  const v1::Job select_job = SubmitJob(connection, spec);
  jobs.push_back(select_job.name());
  if (!Follow(connection, jobs, context, display)) {
    throw CommandFailure(
        ExitCode::kDetached,
        "interrupted before the colouring was submitted; run the same command again "
        "(finished stages are not repeated)");
  }
  const v1::Job imported = GetJob(connection, import_job.name());
  RequireSuccess(connection, context, imported);
  const v1::Job selected = GetJob(connection, select_job.name());
  RequireSuccess(connection, context, selected);
  return {ParseViews(ReadArtifact(connection, imported, artifact::kScene)),
          ParseKeyViews(ReadArtifact(connection, selected, artifact::kKeyView))};
}

// Returns the view of this name, else of this stem, else null: the server reports the error.
const BenchmarkView* FindView(const std::vector<BenchmarkView>& views, const std::string& wanted) {
  for (const BenchmarkView& view : views) {
    if (view.name == wanted) return &view;
  }
  for (const BenchmarkView& view : views) {
    if (Stem(view.name) == Stem(wanted)) return &view;
  }
  return nullptr;
}

// Makes the checks of carry_color before time is spent on geometry.
void CheckAdditionalKeyViews(const ColorizeOptions& options, const Selection& selection) {
  for (const std::string& text : options.additional_key_views) {
    const AdditionalKeyView key = ParseAdditionalKeyView(text);
    const std::string& wanted = key.view;
    const BenchmarkView* view = FindView(selection.views, wanted);
    if (view == nullptr) continue;
    if (view->held_out) {
      throw InvalidArgument(
          "--add-key-view {}: the view {} is held out for evaluation and cannot be a key view",
          wanted,
          view->name);
    }
    if (!key.HasRange() && selection.IsKey(view->name)) {
      throw InvalidArgument(
          "--add-key-view {}: the view {} is already a key view; name each view once",
          wanted,
          view->name);
    }
  }
}

// Adds the photos of the key views and of the scored views to the options of the scene. Returns the
// files to upload.
std::vector<UploadFile> AddTrueColors(const ColorizeOptions& options,
                                      const PhotoFolder& folder,
                                      const GrayCopies& copies,
                                      const Selection& selection,
                                      v1::ColorizeSceneSpec* colorize) {
  std::map<std::string, const LocalFile*> originals;
  for (const LocalFile& photo : folder.photos) originals[photo.path] = &photo;
  std::vector<UploadFile> uploads;
  std::map<std::string, v1::Digest> color_of_key;
  for (const BenchmarkView& view : selection.views) {
    const auto original = originals.find(view.image_file);
    const bool is_key = selection.IsKey(view.name) && !options.color.HasSource();
    const bool is_bound = options.bound && !view.held_out;
    if (original == originals.end() || !(is_key || is_bound || view.held_out)) continue;
    if (!copies.in_color.contains(view.image_file)) {
      if (view.held_out) continue;  // without colour it cannot be scored
      if (is_key) {
        throw InvalidArgument("the key view {} is monochrome; choose one in colour with --key-view",
                              view.name);
      }
      throw InvalidArgument(
          "{} is monochrome; --bound needs the true colours of all views: leave it out", view.name);
    }
    uploads.push_back({original->second->file, DigestFile(original->second->file)});
    const v1::Digest digest = ToProto(uploads.back().digest);
    if (is_key && view.name == selection.key_views[0]) {
      *colorize->mutable_key_color()->mutable_image() = digest;
    } else if (is_key) {
      color_of_key[view.name] = digest;
    }
    if (!view.held_out && !is_bound) continue;
    v1::TruthImage* truth = view.held_out ? colorize->add_truth() : colorize->add_training_truth();
    truth->set_view(view.name);
    *truth->mutable_image() = digest;
  }
  for (size_t i = 1; i < selection.key_views.size(); ++i) {
    v1::FurtherKeyView* added = colorize->mutable_carry_color()->add_further_key_views();
    added->set_view(selection.key_views[i]);
    *added->mutable_color()->mutable_image() = color_of_key.at(selection.key_views[i]);
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
  const ColorCount count = CountColorPhotos(folder, kInspectedPhotos, cancel);
  if (count.MostlyColor()) return;
  throw InvalidArgument(
      "the photographs in {} are monochrome ({} of {} inspected); --benchmark drops the colour of "
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
  display.PrintLine(
      fmt::format("benchmark: dropping the colour of {} photos", folder.photos.size()));
  const GrayCopies copies = MakeGrayCopies(folder, scratch.path(), *context.interrupt);
  const v1::Scene scene = UploadScene(
      connection,
      BuildManifest(copies.folder, MaxFileBytes(connection), *context.interrupt),
      std::filesystem::absolute(folder.root).filename().string() + " (grey)",
      [&](int64_t done, int64_t total) { display.OnTransfer("uploading", done, total); });
  const Selection selection = SelectKeyView(connection, context, options, scene.name(), display);

  CheckAdditionalKeyViews(options, selection);
  v1::JobSpec spec = ColorizeSpec(options, scene.name());
  v1::ColorizeSceneSpec* colorize = spec.mutable_colorize_scene();
  colorize->set_key_view(selection.key_views[0]);
  if (options.color.HasSource()) {
    *colorize->mutable_key_color() = UploadKeyColor(connection, options.color);
  }
  AddKeyViews(connection, options, colorize);
  AddColorizer(connection, options, colorize);
  const auto uploads = AddTrueColors(options, folder, copies, selection, colorize);
  UploadMissing(connection, uploads, [&](int64_t done, int64_t total) {
    display.OnTransfer("uploading true colours", done, total);
  });
  display.PrintLine(fmt::format("key {} {}; {} views are held out and scored",
                                selection.key_views.size() == 1 ? "view" : "views",
                                fmt::join(selection.key_views, ", "),
                                colorize->truth_size()));
  return spec;
}

}  // namespace color3d::client
