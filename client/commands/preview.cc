// `color3d preview`: colours some photos from a coloured key view within seconds, without a job.
#include <algorithm>
#include <filesystem>

#include "client/commands/command.h"
#include "client/commands/console.h"
#include "client/commands/key_jobs.h"
#include "client/commands/live_files.h"
#include "client/commands/results.h"
#include "client/lib/blob_transfer.h"
#include "client/lib/job_watch.h"
#include "client/lib/live_coloring.h"
#include "client/lib/scene_upload.h"
#include "core/catalogue/artifacts.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

struct PreviewOptions {
  std::string target;     // folder of photos or scenes/ID
  std::string key_color;  // the coloured key view
  std::string key;        // the photo that it shows; empty: the one of the same name
  std::string out = "preview";
  int count = 5;
  int max_side_px = 500;
};

// The photos of a scene on the server. Nothing is uploaded.
std::vector<LivePicture> PicturesOf(const v1::Scene& scene) {
  std::vector<LivePicture> pictures;
  for (const v1::SceneFile& file : scene.files()) {
    if (!HasImageExtension(file.path())) continue;
    pictures.push_back({fs::path(file.path()).filename().string(), {}, file.digest()});
  }
  return pictures;
}

// Returns `count` photos, evenly spread, without the key view.
std::vector<LivePicture> Spread(const std::vector<LivePicture>& all,
                                const std::string& key,
                                int count) {
  std::vector<LivePicture> others;
  for (const LivePicture& picture : all) {
    const std::string stem = fs::path(picture.label).stem().string();
    if (picture.label != key && stem != fs::path(key).stem()) others.push_back(picture);
  }
  if (static_cast<int>(others.size()) <= count) return others;
  std::vector<LivePicture> spread;
  for (int i = 0; i < count; ++i) {
    spread.push_back(others[(2 * static_cast<size_t>(i) + 1) * others.size() /
                            (2 * static_cast<size_t>(count))]);
  }
  return spread;
}

v1::Digest UploadExample(Connection& connection, const fs::path& file) {
  const UploadFile upload{file, DigestFile(file)};
  UploadMissing(connection, {upload}, [](int64_t, int64_t) {});
  return ToProto(upload.digest);
}

// The coloured key view of the scene: the accepted one, else the newest.
v1::Digest FindExample(Connection& connection, const std::string& scene, std::string* key) {
  const KeyState state = ReadKeyState(connection, scene);
  const std::optional<v1::Job>& job = state.accepted ? state.accepted : state.colored;
  if (!job) {
    throw Error(ErrorCode::kFailedPrecondition,
                "{} has no coloured key view yet: give one with --key-color, or colour one with "
                "`color3d key color {} ...`",
                scene,
                scene);
  }
  *key = ReadChoice(connection, *job).view;
  return FindArtifact(*job, artifact::kKeyViewColored).digest();
}

ExitCode Preview(const Context& context, const PreviewOptions& options) {
  const bool stored = options.target.starts_with("scenes/") && !fs::is_directory(options.target);
  if (!stored && options.key_color.empty()) {
    throw InvalidArgument("--key-color is missing; give the coloured key view");
  }
  std::vector<LivePicture> pictures;
  if (!stored) pictures = CollectPictures(context, {options.target}, options.out);
  PrepareOut(options.out);
  Connection connection(context.server, *context.interrupt);
  WarmUpInference(connection);
  if (stored) pictures = PicturesOf(GetScene(connection, options.target));
  std::string key = options.key;
  LiveSource source;
  if (options.key_color.empty()) {
    std::string of_scene;
    source.example = FindExample(connection, options.target, &of_scene);
    if (key.empty()) key = of_scene;
  } else {
    source.example = UploadExample(connection, options.key_color);
    if (key.empty()) key = options.key_color;
  }
  pictures = Spread(pictures, key, options.count);
  if (pictures.empty()) throw InvalidArgument("there is no photo besides the key view");
  return PrintSummary(
      context,
      ColorizeToFiles(
          connection, source, pictures, {.max_side_px = options.max_side_px}, options.out),
      options.out);
}

}  // namespace

void AddPreviewCommand(CLI::App& app, Context& context) {
  const auto options = std::make_shared<PreviewOptions>();
  CLI::App* preview = AddCommand(app,
                                 context,
                                 "preview",
                                 "Colour a few photos from a coloured key view within seconds",
                                 [&context, options] { return Preview(context, *options); });
  preview->add_option("photos", options->target, "Folder of photos, or scenes/ID")->required();
  preview->add_option(
      "--key-color",
      options->key_color,
      "The coloured key view; default for scenes/ID: the accepted one, else the newest");
  preview->add_option(
      "--key",
      options->key,
      "Photo that the key view shows, which is left out of the preview; default: the photo of the "
      "same name");
  preview->add_option("-o,--out", options->out, "Folder for the coloured pictures")
      ->capture_default_str();
  preview->add_option("--count", options->count, "Number of photos, evenly spread")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  preview->add_option("--max-side", options->max_side_px, "Longer side of the pictures, px")
      ->check(CLI::Range(16, 8192))
      ->capture_default_str();
}

}  // namespace color3d::client
