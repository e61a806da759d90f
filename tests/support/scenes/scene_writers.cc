#include "tests/support/scenes/scene_writers.h"

#include <fmt/core.h>

#include <charconv>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/lens.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

// Shortest text that reads back as the same double, in every locale.
std::string Text(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return error == std::errc() ? std::string(buffer, end) : "0";
}

void AppendWord(std::string* line, const std::string& word) {
  if (!line->empty()) *line += ' ';
  *line += word;
}

std::string CameraLine(int id, const Camera& c, const Distortion& d) {
  const bool rational = d.k[4] != 0.0 || d.k[5] != 0.0 || d.k[6] != 0.0 || d.k[7] != 0.0;
  std::string model = "PINHOLE";
  size_t coefficients = 0;
  if (d.model == Distortion::Model::kFisheye) {
    model = "OPENCV_FISHEYE";
    coefficients = 4;
  } else if (d.model == Distortion::Model::kBrown) {
    model = rational ? "FULL_OPENCV" : "OPENCV";
    coefficients = rational ? 8 : 4;
  }
  std::string line = fmt::format("{} {} {} {}", id, model, c.width, c.height);
  for (double v : {c.fx, c.fy, c.cx, c.cy}) AppendWord(&line, Text(v));
  for (size_t i = 0; i < coefficients; ++i) AppendWord(&line, Text(d.k[i]));
  return line + "\n";
}

// Numbers 1, 2, ... of the distinct cameras, in order of the views.
std::vector<int> NumberCameras(const Scene& scene, std::string* lines) {
  std::map<std::string, int> numbers;
  std::vector<int> camera_of_view;
  for (const View& view : scene.views) {
    const std::string key = CameraLine(0, view.captured_camera, view.distortion);
    const auto [it, fresh] = numbers.emplace(key, static_cast<int>(numbers.size()) + 1);
    if (fresh) *lines += CameraLine(it->second, view.captured_camera, view.distortion);
    camera_of_view.push_back(it->second);
  }
  return camera_of_view;
}

// Projection of the point, since no measured positions are kept.
Eigen::Vector2d ObservedPixel(const View& view, const Eigen::Vector3d& world) {
  const Eigen::Vector3d p = view.cam_from_world.Apply(world);
  if (p.z() <= 0.0) return {view.captured_camera.cx, view.captured_camera.cy};
  return ProjectCaptured(view.captured_camera, view.distortion, p);
}

}  // namespace

void WriteColmapText(const Scene& scene, const fs::path& model_folder) {
  std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  const std::vector<int> camera_of_view = NumberCameras(scene, &cameras);
  std::string points =
      "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  std::vector<std::string> observations(scene.views.size());
  std::vector<int> observation_count(scene.views.size(), 0);
  for (size_t i = 0; i < scene.points.size(); ++i) {
    const SparsePoint& point = scene.points[i];
    const Eigen::Vector3d p = scene.WorldFromScene(point.position);
    std::string line = std::to_string(i + 1);
    for (int k = 0; k < 3; ++k) AppendWord(&line, Text(p[k]));
    line += " 128 128 128 " + Text(point.reprojection_error_px);
    for (int v : point.views) {
      const Eigen::Vector2d pixel = ObservedPixel(scene.views[v], point.position);
      AppendWord(&observations[v],
                 fmt::format("{} {} {}", Text(pixel.x()), Text(pixel.y()), i + 1));
      AppendWord(&line, fmt::format("{} {}", v + 1, observation_count[v]++));
    }
    points += line + "\n";
  }
  std::string images =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "# POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const Pose& pose = scene.views[i].cam_from_world;
    const Eigen::Quaterniond& q = pose.rotation;
    // s x_cam = R (s x + offset) + t, where s x + offset are the written coordinates.
    const Eigen::Vector3d t =
        scene.world_from_scene_scale * pose.translation - q * scene.world_offset;
    std::string line = std::to_string(i + 1);
    for (double v : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) AppendWord(&line, Text(v));
    line += fmt::format(" {} {}", camera_of_view[i], scene.views[i].name);
    images += line + "\n" + observations[i] + "\n";
  }
  std::error_code error;
  fs::create_directories(model_folder, error);
  WriteFileAtomic(model_folder / "cameras.txt", cameras);
  WriteFileAtomic(model_folder / "images.txt", images);
  WriteFileAtomic(model_folder / "points3D.txt", points);
}

void WriteTransformsJson(const Scene& scene, const fs::path& json_file) {
  json frames = json::array();
  for (const View& view : scene.views) {
    const Camera& c = view.captured_camera;
    const auto& k = view.distortion.k;
    json frame = {{"file_path", view.image_file},
                  {"w", c.width},
                  {"h", c.height},
                  {"fl_x", c.fx},
                  {"fl_y", c.fy},
                  {"cx", c.cx},
                  {"cy", c.cy}};
    if (view.distortion.model == Distortion::Model::kFisheye) {
      frame["camera_model"] = "OPENCV_FISHEYE";
      for (int i = 0; i < 4; ++i) frame[fmt::format("k{}", i + 1)] = k[i];
    } else if (view.distortion.model == Distortion::Model::kBrown) {
      const bool rational = k[5] != 0.0 || k[6] != 0.0 || k[7] != 0.0;
      frame["camera_model"] = rational ? "FULL_OPENCV" : "OPENCV";
      const char* names[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
      for (int i = 0; i < (rational ? 8 : 5); ++i) frame[names[i]] = k[i];
    } else {
      frame["camera_model"] = "PINHOLE";
    }
    if (view.moment) {
      frame["time"] = view.moment->time_s;
      frame["camera"] = fmt::format("cam{:02}", view.moment->shot);
    }
    Eigen::Matrix4d gl = Eigen::Matrix4d::Identity();
    gl.topLeftCorner<3, 3>() = view.cam_from_world.rotation.conjugate().toRotationMatrix() *
                               Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    gl.topRightCorner<3, 1>() = scene.WorldFromScene(view.cam_from_world.Center());
    json rows = json::array();
    for (int r = 0; r < 4; ++r) rows.push_back({gl(r, 0), gl(r, 1), gl(r, 2), gl(r, 3)});
    frame["transform_matrix"] = std::move(rows);
    frames.push_back(std::move(frame));
  }
  try {
    WriteFileAtomic(json_file, json({{"frames", std::move(frames)}}).dump(1) + "\n");
  } catch (const json::exception& e) {
    throw InvalidArgument(std::string("scene cannot be written as JSON: ") + e.what());
  }
}

}  // namespace color3d
