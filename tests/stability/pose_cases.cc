// Structure-from-motion of rendered photos whose cameras are known, placed where two views hardly
// determine a third. Needs COLMAP; run by the benchmark only.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/scene/import/import.h"
#include "tests/stability/tiny_problem.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/look_at.h"
#include "tests/support/scenes/textured_corner.h"

namespace color3d {
namespace {

const Camera kCamera{400, 300, 420.0, 420.0, 200.0, 150.0};

// A textured wall z = 2 and nothing else: L in 0..1.
Image RenderWall(const Pose& pose) {
  Image image(kCamera.width, kCamera.height, 1);
  const Eigen::Vector3d from = pose.Center();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = pose.rotation.conjugate() * kCamera.Ray(x + 0.5, y + 0.5);
      const Eigen::Vector3d hit = from + ray * ((2.0 - from.z()) / ray.z());
      image.At(0, y, x) = CornerTexture(hit.x(), hit.y(), 2);
    }
  }
  return image;
}

// Largest distance of a found centre from its true place after a similarity, relative to the length
// of the path.
double CentreError(const Scene& scene, const std::vector<Pose>& truth) {
  const auto n = static_cast<Eigen::Index>(scene.views.size());
  Eigen::Matrix3Xd found(3, n), expected(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    found.col(i) = scene.views[i].cam_from_world.Center();
    expected.col(i) = truth[std::stoi(scene.views[i].name.substr(1)) - 100].Center();
  }
  const Eigen::Matrix4d align = Eigen::umeyama(found, expected);
  double error = 0.0, path = 0.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    error =
        std::max(error, ((align * found.col(i).homogeneous()).head<3>() - expected.col(i)).norm());
    path = std::max(path, (expected.col(i) - expected.col(0)).norm());
  }
  return error / path;
}

// Either refused with a remedy, or right.
StabilityResult RunPoses(const std::vector<Pose>& truth, bool wall) {
  const ScratchFolder folder, scratch;
  for (size_t i = 0; i < truth.size(); ++i) {
    WriteFileAtomic(folder.path() / ("p" + std::to_string(100 + i) + ".png"),
                    EncodePng8(wall ? RenderWall(truth[i]) : RenderCorner(kCamera, truth[i])));
  }
  StabilityResult r;
  r.condition_of = "-";
  QuietRun run;
  try {
    const ImportResult result =
        ImportScene(folder.path(), scratch.path(), ImportOptions(), run.control());
    r.compared = result.photos_registered;
    r.value_error = CentreError(result.scene, truth);
    r.value_bound = 0.1;
    char text[80];
    std::snprintf(
        text, sizeof(text), "%d of %zu photos placed", result.photos_registered, truth.size());
    r.outcome = text;
  } catch (const Error& e) {
    r.held = e.code() == ErrorCode::kInvalidArgument;
    r.outcome = std::string("refused: ") + e.what();
  }
  return r;
}

std::vector<Pose> Path(int count, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / (count - 1);
    poses.push_back(LookAt(from + t * (to - from), {-0.3, 0.4, 2.0}));
  }
  return poses;
}

}  // namespace

void AddPoseCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, std::vector<Pose> poses, bool wall) {
    cases.push_back({"poses", name, true, [=](ThreadPool&) { return RunPoses(poses, wall); }});
  };
  add("ordinary path", Path(8, {-0.4, -0.2, -1.2}, {1.6, -0.2, -0.8}), false);
  add("a plane wall", Path(8, {-0.8, -0.2, -1.2}, {1.2, -0.1, -0.8}), true);
  add("straight ahead", Path(8, {-0.3, -0.2, -2.4}, {-0.3, -0.2, -0.6}), false);
  add("baseline of a hundredth", Path(8, {0.6, -0.2, -1.2}, {0.63, -0.2, -1.2}), false);
  std::vector<Pose> twice = Path(6, {-0.4, -0.2, -1.2}, {1.6, -0.2, -0.8});
  for (int i = 0; i < 6; ++i)
    twice.push_back(LookAt(twice[i].Center() + Eigen::Vector3d(1e-4, 0, 0), {-0.3, 0.4, 2.0}));
  add("every photo twice", twice, false);
  add("one place", std::vector<Pose>(8, LookAt({0.6, -0.2, -1.2}, {-0.3, 0.4, 2.0})), false);
}

}  // namespace color3d
