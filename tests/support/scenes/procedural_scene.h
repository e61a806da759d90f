// Synthetic scene with exact ground truth: a textured room seen by cameras on an arc, with poses,
// true colours, depth and sparse points with visibility. For tests and the demo.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "core/base/image.h"
#include "core/scene/scene.h"

namespace color3d {

struct ProceduralSceneOptions {
  enum class Poses { kColmap, kTransforms, kNone };
  int views = 12;     // 1..1000
  int width = 320;    // px, 16..8192
  int height = 240;   // px, 16..8192
  uint64_t seed = 1;  // moves furniture slightly, changes all textures
  // Monochrome photos with the L* of the colour photos, which go to truth/.
  bool gray = false;
  bool jpeg = false;  // .jpg (quality 95) instead of .png
  Poses poses = Poses::kColmap;
  int supersampling = 3;     // samples per pixel along each axis, 1..8
  int sparse_points = 3000;  // 0..1000000; each is observed by three views (or all, if fewer)
  int threads = 0;           // 0: all
  void Validate() const;     // throws Error{kInvalidArgument}
};

// Immutable, thread-safe. Equal options give equal scenes on any number of threads.
class ProceduralScene {
 public:
  explicit ProceduralScene(const ProceduralSceneOptions& options);
  ~ProceduralScene();

  // Views "view000.png", ... with image files below images/; no distortion, none held out.
  const Scene& scene() const { return scene_; }
  // True colours: 3 channels, sRGB in 0..1, not yet rounded to 8 bits.
  Image RenderSrgb(int view) const;
  // Depth along the camera's z axis at pixel centres, m: 1 channel.
  Image RenderDepth(int view) const;

 private:
  struct Impl;
  void AddViews();
  void AddSparsePoints();

  ProceduralSceneOptions options_;
  std::unique_ptr<Impl> impl_;
  Scene scene_;
};

// Writes images/view000.png (or .jpg) and so on, and sparse/0 (COLMAP text) or transforms.json.
void WriteProceduralScene(const std::filesystem::path& folder,
                          const ProceduralSceneOptions& options);

}  // namespace color3d
