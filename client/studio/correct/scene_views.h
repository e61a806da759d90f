// Photos of a coloured scene as the service works on them: undistorted, in grey, at screen size.
// Thread-safe.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d::client {

class SceneViews {
 public:
  static constexpr int kSidePx = 1200;  // longer side of pictures, at most

  // `fetch` writes a file of the scene ("images/a.jpg") below `folder`, unless it is there.
  SceneViews(Scene scene,
             std::filesystem::path folder,
             std::function<void(const std::string&)> fetch);

  const Scene& scene() const { return scene_; }
  // Index of a view by its whole name. Throws Error{kNotFound}.
  int Find(const std::string& name) const;
  // name, width, height (px of its picture), photo_width (px as captured), held_out.
  nlohmann::ordered_json Facts() const;
  // Grey JPEG. `side`: longer side, px, at most kSidePx; 0: that. Throws what `fetch` throws.
  std::string Jpeg(int view, int side) const;

  // Strokes in px of the picture of the view as points of `key color --hints`, in px of the photo
  // as captured. Throws Error{kInvalidArgument} for strokes that are none, have no colour, or lie
  // outside of the photo.
  nlohmann::json CapturedStrokes(int view, const nlohmann::json& strokes) const;

 private:
  Camera PictureCamera(int view) const;
  // Px of the picture of the view to px of the photo, kept inside of it.
  std::array<double, 2> Captured(int view, double x, double y) const;

  const Scene scene_;
  const std::filesystem::path folder_;
  const std::function<void(const std::string&)> fetch_;
  const ViewImages images_;
};

}  // namespace color3d::client
