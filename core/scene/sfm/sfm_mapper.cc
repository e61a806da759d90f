#include "core/scene/sfm/sfm_mapper.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/scene/lens.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> MapperThresholds(Strictness strictness) {
  if (strictness == Strictness::kDefault) return {};
  std::vector<std::string> arguments = {
      "--Mapper.init_min_tri_angle", "4", "--Mapper.ba_refine_extra_params", "0"};
  if (strictness == Strictness::kLoose) {
    arguments.insert(arguments.end(),
                     {"--Mapper.init_min_num_inliers",
                      "50",
                      "--Mapper.min_num_matches",
                      "10",
                      "--Mapper.abs_pose_min_num_inliers",
                      "15",
                      "--Mapper.abs_pose_min_inlier_ratio",
                      "0.15"});
  }
  return arguments;
}

// Returns false for degenerate models: very few points, or an absurd lens.
bool IsPlausible(const ColmapModel& model) {
  constexpr size_t kPointsPerPhoto = 10;
  if (model.points.size() < kPointsPerPhoto * model.images.size()) return false;
  for (const auto& [id, image] : model.images) {
    const ColmapCamera& camera = model.cameras.at(image.camera_id);
    const double focal = camera.camera.fx / std::max(camera.camera.width, camera.camera.height);
    if (!(focal > 0.2 && focal < 8.0 && std::abs(camera.distortion.k[0]) < 1.0)) return false;
    try {
      UndistortedCamera(camera.camera, camera.distortion);
    } catch (const Error&) {
      return false;
    }
  }
  return true;
}

// Returns the plausible model with the most photos below `folder`; nullopt if there is none.
std::optional<ColmapModel> BestModel(const fs::path& folder, fs::path* where) {
  std::optional<ColmapModel> best;
  std::set<fs::path> candidates;
  for (const auto& entry : fs::directory_iterator(folder)) candidates.insert(entry.path());
  for (const fs::path& candidate : candidates) {
    if (!IsColmapFolder(candidate)) continue;
    ColmapModel model = LoadColmapModel(candidate);
    if (!IsPlausible(model) || (best && model.images.size() <= best->images.size())) continue;
    best = std::move(model);
    *where = candidate;
  }
  return best;
}

}  // namespace

std::optional<ColmapModel> MapPhotos(ColmapProcess& colmap,
                                     const SfmWorkspace& work,
                                     size_t count,
                                     const std::string& attempt,
                                     Strictness strictness) {
  const fs::path output = work.folder / ("models_" + attempt);
  fs::create_directories(output);
  std::vector<std::string> arguments = {"mapper",
                                        "--random_seed",
                                        "0",
                                        "--database_path",
                                        work.database().string(),
                                        "--image_path",
                                        work.images().string(),
                                        "--output_path",
                                        output.string(),
                                        "--Mapper.num_threads",
                                        colmap.Threads(),
                                        "--Mapper.min_model_size",
                                        std::to_string(kMinPlaced),
                                        "--Mapper.ba_global_function_tolerance",
                                        "1e-6",
                                        "--Mapper.extract_colors",
                                        "0"};
  const std::vector<std::string> thresholds = MapperThresholds(strictness);
  arguments.insert(arguments.end(), thresholds.begin(), thresholds.end());
  const ColmapPhase phase{"placing cameras (" + attempt + " attempt)",
                          "Registering image",
                          static_cast<int64_t>(count)};
  colmap.Run(std::move(arguments), phase);  // a nonzero exit code means no model
  fs::path where;
  std::optional<ColmapModel> best = BestModel(output, &where);
  if (!best || strictness == Strictness::kDefault) return best;
  // Once cameras are registered, distortion is estimated.
  const fs::path refined = work.folder / ("models_" + attempt + "_refined") / "0";
  fs::create_directories(refined);
  const int code = colmap.Run(
      {"bundle_adjuster", "--input_path", where.string(), "--output_path", refined.string()},
      {"refining cameras", "Bundle adjustment report", 1});
  std::optional<ColmapModel> better;
  if (code == 0) better = BestModel(refined.parent_path(), &where);
  if (!better) colmap.Warn("the cameras could not be refined after they were placed");
  return better ? std::move(better) : std::move(best);
}

}  // namespace color3d
