// Small synthetic scenes for tests.
#pragma once

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/progress.h"
#include "core/base/random.h"
#include "core/image/codec.h"
#include "core/scene/lens.h"
#include "core/scene/scene.h"
#include "tests/support/scenes/look_at.h"

namespace color3d {

// Message of the Error that `work` throws; empty if it throws none.
inline std::string Refusal(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

inline Image GradientPhoto(int width, int height, int channels) {
  Image image(width, height, channels);
  for (int c = 0; c < channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        image.At(c, y, x) = 0.1f + 0.8f * static_cast<float>(c == 1 ? y : x) /
                                       static_cast<float>(c == 1 ? height : width);
      }
    }
  }
  return image;
}

// `count` cameras of 48 x 32 px on an arc around the origin, and 50 points that all observe.
inline Scene ArcScene(int count, const Distortion& distortion = {}) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    View view;
    char name[16];
    std::snprintf(name, sizeof(name), "%04d.png", i + 1);
    view.name = name;
    view.image_file = "images/" + view.name;
    view.captured_camera = {48, 32, 50.0, 51.0, 24.5, 15.0};
    view.distortion = distortion;
    view.camera = UndistortedCamera(view.captured_camera, distortion);
    const double angle = -0.6 + 1.2 * i / std::max(1, count - 1);
    view.cam_from_world =
        LookAt({4.0 * std::sin(angle), -0.3, -4.0 * std::cos(angle)}, Eigen::Vector3d::Zero());
    scene.views.push_back(std::move(view));
  }
  Random random(11);
  for (int i = 0; i < 50; ++i) {
    SparsePoint point;
    for (int k = 0; k < 3; ++k) point.position[k] = random.NextUniform(-0.7, 0.7);
    point.reprojection_error_px = 0.5;
    for (int v = 0; v < count; ++v) point.views.push_back(v);
    scene.points.push_back(std::move(point));
  }
  return scene;
}

// Writes the photos of a scene below `folder`.
inline void WritePhotos(const Scene& scene, const std::filesystem::path& folder) {
  for (const View& view : scene.views) {
    const std::filesystem::path path = folder / view.image_file;
    std::filesystem::create_directories(path.parent_path());
    WriteFileAtomic(
        path,
        EncodePng8(GradientPhoto(view.captured_camera.width, view.captured_camera.height, 1)));
  }
}

class RecordingObserver : public NullObserver {
 public:
  void OnProgress(int64_t, int64_t, const std::string& message) override {
    messages += message + "\n";
  }
  void OnWarning(const std::string& message) override { warnings += message + "\n"; }
  std::string messages;
  std::string warnings;
};

}  // namespace color3d
