// Surrogates for a generative model's variations of the coloured key view, without a model: the
// picture extended beyond its border, the next frame of a film, and views from nearby cameras
// (STILL.md "Stage 1c"). Thread-safe if the renderer is.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/augment/depth_warp.h"
#include "core/augment/generated_picture.h"
#include "core/base/cancellation.h"
#include "core/scene/scene.h"

namespace color3d {

enum class AugmentationKind { kOutpaint, kAnimate, kNovelView };

// The coloured key view at working size.
struct KeyPicture {
  Image lab;  // 3 channels, Lab units
  Camera camera;
  Pose cam_from_world;
};

// Rendering of the luminance geometry from a camera, 1 channel each.
struct RenderedGeometry {
  Image luminance;  // L
  Image depth;
  Image opacity;
};
using GeometryRenderer =
    std::function<RenderedGeometry(const Camera& camera, const Pose& cam_from_world)>;

class Surrogates {
 public:
  // `render`: renders the luminance geometry; empty: no novel views, and film frames by flow only.
  // The references must outlive the object.
  Surrogates(const KeyPicture& key,
             const Scene& scene,
             int key_index,
             GeometryRenderer render,
             uint64_t seed,
             const CancellationToken& cancel);

  // Returns the reason why this kind cannot be made, or an empty string.
  std::string Obstacle(AugmentationKind kind) const;
  // Returns picture `index` (from 0) of its kind, or nothing if the key view covers too little of
  // it. Throws Error{kCancelled}.
  std::optional<GeneratedPicture> Make(AugmentationKind kind, int index) const;

 private:
  GeneratedPicture Warp(const Pose& target) const;
  GeneratedPicture Animate(int index) const;
  GeneratedPicture NovelView(int index) const;

  const KeyPicture& key_;
  const GeometryRenderer render_;
  const uint64_t seed_;
  const CancellationToken& cancel_;
  DepthView depth_view_;
  double median_depth_ = 0.0;  // <= 0: unknown
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double angle_ = 0.0;
};

}  // namespace color3d
