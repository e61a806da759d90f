// color3d-bench poses: measures seconds per phase of structure-from-motion, and the distance of its
// cameras from a given model.
#include <sqlite3.h>
#include <sys/resource.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/import/import.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

struct PosesArguments {
  std::string scene_folder;
  std::string truth_folder;
  std::string pairs = "planned";
  std::string json_file;
  std::string keep_folder;
  int threads = 0;
  ImportOptions options;
};

class WarningList : public NullObserver {
 public:
  void OnWarning(const std::string& message) override { warnings.push_back(message); }
  std::vector<std::string> warnings;
};

// Number of pairs in COLMAP's database with enough verified matches for its mapper; -1 if it cannot
// be read.
int CountVerifiedPairs(const fs::path& database) {
  sqlite3* db = nullptr;
  sqlite3_stmt* query = nullptr;
  int count = -1;
  if (sqlite3_open_v2(database.c_str(), &db, SQLITE_OPEN_READONLY, nullptr) == SQLITE_OK &&
      sqlite3_prepare_v2(
          db, "SELECT COUNT(*) FROM two_view_geometries WHERE rows >= 15", -1, &query, nullptr) ==
          SQLITE_OK &&
      sqlite3_step(query) == SQLITE_ROW) {
    count = sqlite3_column_int(query, 0);
  }
  sqlite3_finalize(query);
  sqlite3_close(db);
  return count;
}

// Differences of camera centres and viewing directions from a model's, after alignment by a
// similarity transform of the centres (Umeyama 1991).
nlohmann::ordered_json CompareWithModel(const Scene& found, const Scene& model) {
  std::map<std::string, const View*> view_of_name;
  for (const View& view : model.views) view_of_name[view.name] = &view;
  std::vector<std::pair<const View*, const View*>> both;
  for (const View& view : found.views) {
    const auto it = view_of_name.find(view.name);
    if (it != view_of_name.end()) both.emplace_back(&view, it->second);
  }
  nlohmann::ordered_json result{{"model_views", model.views.size()}, {"common", both.size()}};
  if (both.size() < 4) return result;
  const auto n = static_cast<Eigen::Index>(both.size());
  Eigen::Matrix3Xd from(3, n), to(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    from.col(i) = both[i].first->cam_from_world.Center();
    to.col(i) = both[i].second->cam_from_world.Center();
  }
  const Eigen::Matrix4d align = Eigen::umeyama(from, to, true);
  const double scale = std::cbrt(align.topLeftCorner<3, 3>().determinant());
  const Eigen::Matrix3d rotation = align.topLeftCorner<3, 3>() / scale;
  const Eigen::Matrix3Xd moved = (align * from.colwise().homogeneous()).topRows<3>();
  const double extent = (to.rowwise().maxCoeff() - to.rowwise().minCoeff()).norm();
  const Eigen::VectorXd off = (moved - to).colwise().norm();
  double sum_deg = 0.0, worst_deg = 0.0;
  for (const auto& [mine, theirs] : both) {
    const Eigen::Matrix3d turn = mine->cam_from_world.rotation.toRotationMatrix() *
                                 rotation.transpose() *
                                 theirs->cam_from_world.rotation.toRotationMatrix().transpose();
    const double deg = Eigen::AngleAxisd(turn).angle() * 180.0 / M_PI;
    sum_deg += deg;
    worst_deg = std::max(worst_deg, deg);
  }
  result["centre_rms_over_extent"] = std::sqrt(off.squaredNorm() / n) / extent;
  result["centre_worst_over_extent"] = off.maxCoeff() / extent;
  result["rotation_mean_deg"] = sum_deg / n;
  result["rotation_worst_deg"] = worst_deg;
  return result;
}

// CPU time of this process and its finished children.
double CpuSeconds() {
  double seconds = 0.0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
  }
  return seconds;
}

// The scene's photos without its poses, so that import estimates them.
void CopyPhotos(const fs::path& scene_folder, const fs::path& folder) {
  const fs::path images = scene_folder / "images";
  fs::copy(
      fs::exists(images) ? images : scene_folder, folder / "images", fs::copy_options::recursive);
}

nlohmann::ordered_json PointFacts(const Scene& scene) {
  double track = 0.0, error_px = 0.0;
  for (const SparsePoint& point : scene.points) {
    track += static_cast<double>(point.views.size());
    error_px += point.reprojection_error_px;
  }
  const double n = std::max<double>(1.0, static_cast<double>(scene.points.size()));
  return {{"points", scene.points.size()},
          {"mean_track_length", track / n},
          {"mean_reprojection_error_px", error_px / n}};
}

void RunPoses(PosesArguments& args) {
  if (args.pairs == "exhaustive") args.options.sfm_pairs = SfmPairs::kExhaustive;
  const ScratchFolder photos, scratch;
  CopyPhotos(args.scene_folder, photos.path());
  const fs::path work = args.keep_folder.empty() ? scratch.path() : fs::path(args.keep_folder);
  WarningList observer;
  QuietRun run(args.threads);
  const auto start = std::chrono::steady_clock::now();
  const ImportResult imported =
      ImportScene(photos.path(), work, args.options, run.ReportingTo(observer));
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const SfmReport& sfm = imported.sfm;
  nlohmann::ordered_json result{{"scene", args.scene_folder},
                                {"pairs", args.pairs},
                                {"threads", args.threads},
                                {"seconds", seconds},
                                {"cpu_seconds", CpuSeconds()},
                                {"seconds_photos", sfm.photos_seconds},
                                {"seconds_features", sfm.features_seconds},
                                {"seconds_matching", sfm.matching_seconds},
                                {"seconds_mapping", sfm.mapping_seconds},
                                {"photos", imported.photos_found},
                                {"registered", imported.photos_registered},
                                {"plan", sfm.plan},
                                {"pairs_tried", sfm.pairs_tried},
                                {"pairs_verified", CountVerifiedPairs(work / "database.db")},
                                {"all_pairs_matched", sfm.exhaustive}};
  result.update(PointFacts(imported.scene));
  result["warnings"] = observer.warnings;
  const fs::path truth = args.truth_folder.empty() ? args.scene_folder : args.truth_folder;
  if (fs::exists(truth / "sparse/0") || fs::exists(truth / "poses_bounds.npy")) {
    const Scene given =
        ImportScene(truth, scratch.path(), args.options, run.ReportingTo(observer)).scene;
    result["against_model"] = CompareWithModel(imported.scene, given);
  }
  WriteResult(result, args.json_file);
}

}  // namespace

void AddPosesCommand(CLI::App& app) {
  auto args = std::make_shared<PosesArguments>();
  CLI::App* command =
      app.add_subcommand("poses", "Measure time and registered views of structure-from-motion");
  command
      ->add_option("--scene", args->scene_folder, "Folder with images/, and poses to compare with")
      ->required();
  command->add_option("--truth",
                      args->truth_folder,
                      "Folder with images/ and poses that the photos were made from; default: that "
                      "of --scene");
  command->add_option("--pairs", args->pairs, "Pairs of photos to match")
      ->check(CLI::IsMember({"planned", "exhaustive"}));
  command->add_option("--neighbors",
                      args->options.sfm_neighbors,
                      "Number of similar photos to match with each photo");
  command->add_option(
      "--max-features", args->options.sfm_max_features, "Maximum number of features per photo");
  command->add_option("--threads", args->threads, "Number of threads; 0: one per core");
  command->add_option("--keep", args->keep_folder, "Folder for COLMAP's files and sfm.log");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunPoses(*args); });
}

}  // namespace color3d
