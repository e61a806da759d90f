// What the planner knows of a scene before it is imported.
#pragma once

#include <string_view>

namespace color3d {

// Pictures in colour that the user gives for the colorizer to learn from: no photos of the scene.
inline bool IsAugmentFile(std::string_view path) { return path.starts_with("augment/"); }

// Masks of photos: what of them counts.
inline bool IsMaskFile(std::string_view path) { return path.starts_with("masks/"); }

// Views that are drawn from a splat in place of photos, unless its options say otherwise.
inline constexpr int kSplatViews = 24;

struct SceneFacts {
  int photos = 0;
  bool has_poses = false;
  int augment_files = 0;
  bool is_film = false;   // frames without poses: coloured, not reconstructed
  bool is_splat = false;  // its Gaussians are the geometry; `photos` are the views drawn from it
};

}  // namespace color3d
