// Where extra training pictures come from: the user's files, a model server of the user's, and our
// own weight-free surrogates. Internal to the stage generate_augmentations.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/augment/depth_warp.h"
#include "core/augment/generated_picture.h"
#include "core/scene/scene.h"
#include "core/stage/stages.h"

namespace color3d {

enum class AugmentationKind { kOutpaint, kAnimate, kNovelView };

// "outpaint", "animate", "novel_view": as in stage.proto and backend.proto.
const char* AugmentationKindName(AugmentationKind kind);

struct Augmentation {
  std::string name;    // of the artifact, without folder and ending
  std::string kind;    // AugmentationKindName, or "file"
  std::string source;  // "embedded", "backend NAME", or the file's name
  GeneratedPicture picture;
};

// The coloured key view at working size, and what geometry knows of it.
struct KeyPicture {
  Image lab;      // 3 channels, Lab units
  Image srgb;     // 3 channels, 0..1: the same for a backend, perhaps larger
  Camera camera;  // of lab
  Pose cam_from_world;
};

// Photos in colour below augment/ of the scene's folder, sorted by name, at most `max_side_px`.
// Throws Error{kInvalidArgument} naming a file that is no picture, has no colour or is too small,
// or when there are too many.
std::vector<Augmentation> AugmentationsFromFiles(int max_side_px, const StageContext& context);

// `count` pictures of one kind by the generator `backend`, which must claim it. Throws what
// RemoteColorizer throws; Error{kFailedPrecondition} for answers that are no pictures in colour.
std::vector<Augmentation> AugmentationsFromBackend(const std::string& backend,
                                                   RemoteColorizer& remote,
                                                   const RemoteInfo& info,
                                                   AugmentationKind kind,
                                                   int count,
                                                   const KeyPicture& key,
                                                   int max_side_px,
                                                   StageContext& context);

// Makes pictures of any kind from the key view alone, or with its geometry.
class EmbeddedAugmentations {
 public:
  // `model`: the luminance geometry; none: no novel views, and the film frame is a mere flow.
  EmbeddedAugmentations(const KeyPicture& key,
                        const Scene& scene,
                        int key_index,
                        std::optional<GaussianModel> model,
                        StageContext& context);

  // Why this kind cannot be made; empty when it can.
  std::string Obstacle(AugmentationKind kind) const;
  // The picture number `index` (from 0) of its kind; nothing, when the key view covers too little
  // of what it would show.
  std::optional<Augmentation> Make(AugmentationKind kind, int index) const;

 private:
  GeneratedPicture Warp(const Pose& target) const;
  GeneratedPicture Animate(int index) const;
  GeneratedPicture NovelView(int index) const;

  const KeyPicture& key_;
  StageContext& context_;
  std::optional<GaussianModel> model_;
  std::unique_ptr<ThreadPool> pool_;
  DepthView depth_view_;
  double median_depth_ = 0.0;  // <= 0: nothing is known
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double angle_ = 0.0;
};

}  // namespace color3d
