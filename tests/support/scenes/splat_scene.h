// Small posed scene for tests: coloured walls of a room corner, seen by cameras on an arc, with
// ray-cast pictures. No files.
#pragma once

#include <memory>

#include "core/base/image.h"
#include "core/scene/scene.h"

namespace color3d::testing_scene {

struct ProceduralScene {
  Scene scene;
  std::vector<Image> lab;  // 3 channels, Lab units, one per view
  std::shared_ptr<const Image> Luminance(int view) const;
  Image Ab(int view) const;
};

// `views` cameras of width x height px; `points` sparse points on the walls.
ProceduralScene MakeRoomCorner(int views, int width, int height, int points);

}  // namespace color3d::testing_scene
