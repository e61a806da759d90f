#include "core/scene/formats/given_points.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/base/evenly.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/pose_files.h"
#include "core/catalogue/scene_files.h"
#include "core/scene/formats/point_ply.h"
#include "core/scene/named_files.h"
#include "core/scene/sparse_cloud.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;
using Positions = std::vector<Eigen::Vector3d>;

constexpr size_t kMaxPoints = 200'000;
constexpr uintmax_t kMaxBytes = uintmax_t{1} << 30;
constexpr size_t kTriedPoints = 2000;
constexpr size_t kFewestViews = 2;

void Warn(std::vector<std::string>* warnings, std::string text) {
  if (warnings != nullptr) warnings->push_back(std::move(text));
}

NamedFiles PlyFiles(const fs::path& scene_folder) {
  std::vector<std::string> files;
  for (std::string& file : ListFiles(scene_folder)) {
    if (HasSplatExtension(file) && !IsAugmentFile(file) && file.size() > 4 &&
        (file.ends_with(".ply") || file.ends_with(".PLY"))) {
      files.push_back(std::move(file));
    }
  }
  return NamedFiles(std::move(files));
}

// Returns the file of points, relative to the scene's folder; empty if there is none.
std::string FindPointFile(const json& transforms,
                          const std::string& file_name,
                          const fs::path& scene_folder,
                          std::vector<std::string>* warnings) {
  const auto named = transforms.find("ply_file_path");
  if (named != transforms.end() && named->is_string() && !named->get<std::string>().empty()) {
    const std::string name = named->get<std::string>();
    const std::string file = PlyFiles(scene_folder).Find(name);
    if (file.empty()) {
      Warn(warnings,
           fmt::format(
               "the points in {}, which {} names, are not among the files given", name, file_name));
    }
    return file;
  }
  for (const std::string_view file : kPointFiles) {
    if (IsFile(scene_folder / file)) return std::string(file);
  }
  return "";
}

// Returns applied_transform, 3 x 4 or 4 x 4; nullopt if it is missing or no transform.
std::optional<Eigen::Affine3d> AppliedTransform(const json& transforms) {
  const auto rows = transforms.find("applied_transform");
  if (rows == transforms.end() || !rows->is_array() || rows->size() < 3) return std::nullopt;
  Eigen::Affine3d applied = Eigen::Affine3d::Identity();
  for (int r = 0; r < 3; ++r) {
    const json& row = (*rows)[static_cast<size_t>(r)];
    if (!row.is_array() || row.size() != 4) return std::nullopt;
    for (int c = 0; c < 4; ++c) {
      const json& value = row[static_cast<size_t>(c)];
      if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
      applied.matrix()(r, c) = value.get<double>();
    }
  }
  if (!(std::abs(applied.linear().determinant()) > 1e-12)) return std::nullopt;
  return applied;
}

// Returns the fraction of points that at least two views see, 0..1.
double ShareSeen(const Scene& scene, const Positions& points, const Eigen::Affine3d& transform) {
  size_t seen = 0;
  for (const Eigen::Vector3d& point : points) {
    seen += ViewsFacing(scene, transform * point, 0.0).size() >= kFewestViews;
  }
  return static_cast<double>(seen) / static_cast<double>(std::max<size_t>(1, points.size()));
}

// Returns the transform from the file's frame to that of the poses.
Eigen::Affine3d PointTransform(const json& transforms,
                               const Scene& scene,
                               const Positions& points) {
  const Eigen::Affine3d as_it_is = Eigen::Affine3d::Identity();
  const std::optional<Eigen::Affine3d> applied = AppliedTransform(transforms);
  if (!applied) return as_it_is;
  const Positions tried = PickEvenly(points, kTriedPoints);
  Eigen::Affine3d best = as_it_is;
  // Keeps the points in the frame of the poses unless far fewer are visible there.
  double most = 2.0 * ShareSeen(scene, tried, as_it_is);
  for (const Eigen::Affine3d& other : {*applied, applied->inverse()}) {
    const double share = ShareSeen(scene, tried, other);
    if (share > most) best = other, most = share;
  }
  return best;
}

}  // namespace

std::vector<SparsePoint> ReadGivenPoints(const json& transforms,
                                         const std::string& file_name,
                                         const fs::path& scene_folder,
                                         const Scene& scene,
                                         std::vector<std::string>* warnings) {
  std::vector<SparsePoint> points;
  const std::string file = FindPointFile(transforms, file_name, scene_folder, warnings);
  if (file.empty()) return points;
  std::error_code error;
  if (const auto bytes = fs::file_size(scene_folder / file, error); error || bytes > kMaxBytes) {
    Warn(warnings,
         fmt::format("the given points are not used: {} has more than {} MiB; give fewer points",
                     file,
                     kMaxBytes >> 20));
    return points;
  }
  Positions positions;
  try {
    positions = ReadPointPly(ReadFile(scene_folder / file), file, kMaxPoints);
  } catch (const Error& e) {
    Warn(warnings, fmt::format("the given points are not used: {}", e.what()));
    return points;
  }
  const Eigen::Affine3d transform = PointTransform(transforms, scene, positions);
  for (const Eigen::Vector3d& position : positions) {
    SparsePoint point;
    point.position = transform * position;
    if (!point.position.allFinite()) continue;
    point.reprojection_error_px = -1.0;
    point.views = ViewsFacing(scene, point.position, 0.0);
    if (point.views.size() >= kFewestViews) points.push_back(std::move(point));
  }
  Warn(warnings,
       points.empty()
           ? fmt::format("none of the {} points in {} lies where two photos show it; they are not "
                         "used",
                         positions.size(),
                         file)
           : fmt::format("geometry starts from {} points of {}", points.size(), file));
  return points;
}

}  // namespace color3d
