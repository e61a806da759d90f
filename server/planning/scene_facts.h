// Facts about a scene that are known before its import.
#pragma once

namespace color3d {

// Default of import_scene.splat_views.
inline constexpr int kSplatViews = 24;

struct SceneFacts {
  int photos = 0;  // of a film its pictures; 0 for video files, whose frames nobody has counted
  bool has_poses = false;
  int augment_files = 0;
  bool is_film = false;   // frames without poses: coloured, not reconstructed
  bool is_splat = false;  // its Gaussians are the geometry; `photos` are the views drawn from it
};

}  // namespace color3d
