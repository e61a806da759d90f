#include "core/stage/film/frames_of_views.h"

#include <utility>

namespace color3d {

FilmFrames FramesOfViews(const Scene& scene, std::vector<int> views, const ViewImages& images) {
  FilmFrames frames;
  for (const int view : views) {
    frames.shot.push_back(scene.views[view].moment->shot);
    frames.time_s.push_back(scene.views[view].time_s());
  }
  frames.luminance = [&images, views = std::move(views)](int frame) {
    return images.Luminance(views[frame]);
  };
  return frames;
}

std::map<int, std::vector<int>> FramesByShot(const Scene& scene) {
  std::map<int, std::vector<int>> frames;
  for (const int view : scene.ViewsInOrderOfTime()) {
    frames[scene.views[view].moment->shot].push_back(view);
  }
  return frames;
}

}  // namespace color3d
