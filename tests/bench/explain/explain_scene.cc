#include "tests/bench/explain/explain_scene.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/plane_sampling.h"
#include "core/scene/view_images.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/raster/render.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr int kMatchStridePx = 4;
constexpr int kMaxPairs = 12;  // of each gap
constexpr size_t kLeastMatches = 50;

std::string ReadOf(const fs::path& run, const char* name) {
  if (!fs::exists(run / name)) {
    throw InvalidArgument(
        "{} has no {}; give the output folder of color3d-bench pipeline", run.string(), name);
  }
  return ReadFile(run / name);
}

int ReadKey(const fs::path& run, const Scene& scene) {
  try {
    const auto json = nlohmann::json::parse(ReadOf(run, artifact::kKeyView));
    return scene.FindView(json.at("view").get<std::string>());
  } catch (const nlohmann::json::exception& error) {
    throw InvalidArgument("{} is damaged: {}; run the pipeline again",
                          (run / artifact::kKeyView).string(),
                          error.what());
  }
}

// Indices in ascending order: `most` evenly spread ones, and the key view. Requires: most >= 2.
std::vector<int> ChooseViews(int count, int key, int most) {
  std::set<int> chosen = {key};
  const int kept = std::min(count, most);
  for (int i = 0; i < kept; ++i) {
    chosen.insert(kept == count ? i : static_cast<int>(int64_t{i} * (count - 1) / (kept - 1)));
  }
  return {chosen.begin(), chosen.end()};
}

Image ReadTruth(const ViewImages& images, const Scene& scene, int view, const fs::path& folder) {
  const fs::path file = folder / scene.views[view].image_file;
  if (!fs::exists(file)) {
    throw InvalidArgument("{} is missing; give the scene that the run is of", file.string());
  }
  const Image photo = ReadImage(file);
  if (photo.channels != 3 || IsGray(photo)) {
    throw InvalidArgument("{} is grey; explain compares with true colours", file.string());
  }
  return LabFromSrgb(images.Undistort(view, photo));
}

Image WarpedTo(const ExplainView& from, const ExplainView& to) {
  Image warped = to.luminance;
  MatchOptions every_pixel;
  for (const PixelMatch& match : MatchByGeometry(to.geometry, from.geometry, every_pixel)) {
    warped.At(0, match.y, match.x) =
        SampleBilinear(from.luminance, 0, match.u - 0.5, match.v - 0.5);
  }
  return warped;
}

std::vector<ExplainPair> FindPairs(const std::vector<ExplainView>& views, ThreadPool& pool) {
  const std::vector<ViewPair> wanted =
      ConsistencyPairs({static_cast<int>(views.size())}, kMaxPairs);
  std::vector<ExplainPair> pairs(wanted.size());
  pool.ForEach(static_cast<int64_t>(wanted.size()), [&](int64_t i, int) {
    const ExplainView& first = views[wanted[i].first];
    const ExplainView& second = views[wanted[i].second];
    MatchOptions options;
    options.stride_px = kMatchStridePx;
    pairs[i] = {wanted[i].first,
                wanted[i].second,
                MatchByGeometry(first.geometry, second.geometry, options),
                WarpedTo(first, second)};
  });
  std::erase_if(pairs, [](const ExplainPair& pair) { return pair.matches.size() < kLeastMatches; });
  return pairs;
}

}  // namespace

ExplainScene ReadExplainScene(const std::filesystem::path& folder,
                              const std::filesystem::path& run,
                              int side_px,
                              int most,
                              ThreadPool& pool) {
  const Scene scene = SceneFromJson(ReadOf(run, artifact::kScene));
  if (scene.kind() != CaptureKind::kStatic) {
    throw InvalidArgument("{} is a film or a dynamic scene; explain needs a static one",
                          folder.string());
  }
  const GaussianModel geometry = ParseGaussians(ReadOf(run, artifact::kGeometry));
  const ViewImages images(scene, folder, side_px);
  const int key = ReadKey(run, scene);
  ExplainScene result;
  for (const int view : ChooseViews(static_cast<int>(scene.views.size()), key, most)) {
    if (view == key) result.key = static_cast<int>(result.views.size());
    ExplainView& read = result.views.emplace_back();
    read.name = scene.views[view].name;
    read.held_out = scene.views[view].held_out;
    read.lab = ReadTruth(images, scene, view, folder);
    read.luminance = LuminanceOfLab(read.lab);
    read.geometry = {images.WorkingCamera(view), scene.views[view].cam_from_world, {}};
    read.geometry.depth =
        RenderView(geometry, read.geometry.camera, read.geometry.cam_from_world, pool).depth;
  }
  result.pairs = FindPairs(result.views, pool);
  if (result.pairs.empty()) {
    throw InvalidArgument("no two of the {} views of {} show common surfaces; explain needs two",
                          result.views.size(),
                          folder.string());
  }
  return result;
}

}  // namespace color3d
