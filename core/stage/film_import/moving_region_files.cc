#include "core/stage/film_import/moving_region_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/scene/photo_masks.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

constexpr int64_t kMotionFramesCacheBytes = int64_t{64} << 20;

std::string Name(int view) { return fmt::format("{:06}.png", view); }

}  // namespace

MovingRegionFiles::MovingRegionFiles(const Scene& scene, fs::path folder)
    : scene_(scene), folder_(std::move(folder)) {
  for (const char* kind : {"moving", "still"}) fs::create_directories(folder_ / kind);
}

void MovingRegionFiles::Write(int view, const Image& moving) const {
  WriteFileAtomic(MovingFile(view), EncodePng8(moving));
  Image still = moving;
  for (float& v : still.data) v = 1.0f - v;
  // Without static background there is no mask: such a frame is placed by its moving objects.
  if (std::ranges::all_of(still.data, [](float v) { return v == 0.0f; })) return;
  const Camera& camera = scene_.views[view].captured_camera;
  WriteFileAtomic(folder_ / "still" / Name(view),
                  EncodePng8(ResizeMask(still, camera.width, camera.height)));
}

fs::path MovingRegionFiles::MovingFile(int view) const { return folder_ / "moving" / Name(view); }

fs::path MovingRegionFiles::StillFile(int view) const {
  const fs::path file = folder_ / "still" / Name(view);
  return fs::exists(file) ? file : fs::path();
}

void MovingRegionFiles::Publish(const Scene& placed, StageContext& context) const {
  for (const View& view : placed.views) {
    context.MoveOutput(ViewArtifact(artifact::kMovingRegions, view),
                       MovingFile(scene_.FindView(view.name)));
  }
}

ShotMotion WriteMovingRegions(const fs::path& frames_root,
                              const Scene& scene,
                              const std::vector<int>& shot,
                              const MovingRegionFiles& files,
                              StageContext& context) {
  const ViewImages images(scene, frames_root, kMotionSidePx, kMotionFramesCacheBytes);
  const auto count = static_cast<int>(shot.size());
  int done = 0;
  return FindMovingRegions({count, [&](int frame) { return images.Luminance(shot[frame]); }},
                           context.pool(),
                           context.cancel(),
                           [&](int frame, const Image& moving) {
                             files.Write(shot[frame], moving);
                             context.ReportProgress(++done, count, "finding moving objects");
                           });
}

}  // namespace color3d
