// Facts about a scene that are known before its import. Pure functions, thread-safe.
#pragma once

#include <algorithm>

#include "color3d/v1/stage.pb.h"
#include "core/catalogue/captures.h"
#include "core/catalogue/scene_files.h"
#include "server/store/job.h"

namespace color3d {

// Default of import_scene.splat_views.
inline constexpr int kSplatViews = 24;

struct SceneFacts {
  int pictures = 0;  // photos or frames; 0 for splats, and for video files before import
  CaptureLayout layout = CaptureLayout::kPhotos;
  int augment_files = 0;
};

// Requires: the record has its files.
inline SceneFacts SceneFactsFrom(const SceneRecord& scene) {
  return {.pictures = scene.photo_count,
          .layout = scene.layout,
          .augment_files = static_cast<int>(
              std::count_if(scene.files.begin(), scene.files.end(), [](const auto& file) {
                return IsAugmentFile(file.path);
              }))};
}

inline bool EstimatesPoses(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const PoseSource poses = InfoOf(facts.layout).poses;
  return poses == PoseSource::kEstimated ||
         (poses == PoseSource::kOnRequest &&
          import.film_poses() == v1::ImportSceneSpec::FILM_POSES_AUTO);
}

// Kind of scene that the import will make, as far as it is known.
inline CaptureKind KindBeforeImport(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const CaptureLayoutInfo& layout = InfoOf(facts.layout);
  return layout.poses == PoseSource::kOnRequest && EstimatesPoses(facts, import)
             ? CaptureKind::kDynamic
             : layout.kind;
}

}  // namespace color3d
