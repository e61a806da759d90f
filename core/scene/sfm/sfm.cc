#include "core/scene/sfm/sfm.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats/colmap_model.h"
#include "core/scene/lens.h"
#include "core/scene/sfm/colmap_process.h"
#include "core/scene/sfm/pair_planner.h"
#include "core/scene/sfm/parallax.h"
#include "core/scene/sfm/sfm_mapper.h"
#include "core/scene/sfm/sfm_matching.h"
#include "core/scene/sfm/sfm_photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

// Up to this number of photos, all pairs are matched as a fallback; beyond it that takes hours.
constexpr size_t kExhaustiveLimit = 60;
// Enough features to compare photos; fewer are used if there are many pairs.
constexpr int kMaxLocalFeatures = 300;
constexpr int kMinLocalFeatures = 100;

int LocalFeatureCount(size_t photos) {
  return std::clamp(
      static_cast<int>(100 * kMaxLocalFeatures / photos), kMinLocalFeatures, kMaxLocalFeatures);
}

class Stopwatch {
 public:
  explicit Stopwatch(double* seconds) : seconds_(seconds) {}
  ~Stopwatch() {
    *seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double* seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Stages of one run, the best model so far, and how it was obtained.
class Solver {
 public:
  Solver(ColmapProcess& colmap,
         const SfmWorkspace& work,
         const FeatureImages& copies,
         const ImportOptions& options,
         PhotoOrder order,
         const RunControl& run,
         SfmReport* report)
      : colmap_(colmap),
        work_(work),
        copies_(copies),
        options_(options),
        order_(order),
        run_(run),
        report_(report) {}

  // Empty model if no photo was registered.
  ColmapModel Solve(const PairPlan& plan) {
    const bool planned = plan.pairs.size() < AllPairs(Count()).size();
    if (planned) {
      SolvePlanned(plan);
      if (PlannedPairsSuffice()) return std::move(*best_);
      if (order_ == PhotoOrder::kSequence) return best_ ? std::move(*best_) : ColmapModel{};
      if (IsHopeless(plan)) {
        colmap_.Note(
            fmt::format("{} of {} photos look like another one; comparing all pairs, which "
                        "takes much longer, would find no more",
                        plan.related,
                        Count()));
        return ColmapModel{};
      }
      colmap_.Warn(
          fmt::format("the planned pairs connect {} of {} photos; comparing all pairs, which takes "
                      "longer",
                      Placed(),
                      Count()));
    }
    SolveExhaustively(planned);
    return best_ ? std::move(*best_) : ColmapModel{};
  }

 private:
  int Count() const { return static_cast<int>(copies_.names.size()); }
  size_t Placed() const { return best_ ? best_->images.size() : 0; }
  bool IsHalfPlaced() const {
    return 2 * Placed() >= copies_.names.size() && Placed() >= kMinPlaced;
  }
  bool AreNearlyAllPlaced() const {
    return IsHalfPlaced() && 10 * Placed() >= 9 * copies_.names.size();
  }
  // True if further attempts could only add pairs of registered photos, or finer features.
  bool PlannedPairsSuffice() const {
    return AreNearlyAllPlaced() ||
           (IsHalfPlaced() && (!has_coarse_features_ || copies_.names.size() > kExhaustiveLimit));
  }

  // The most similar pairs failed, and they are not similar.
  bool IsHopeless(const PairPlan& plan) const {
    return Placed() == 0 && plan.related < static_cast<int>(kMinPlaced);
  }

  void Extract(FeatureDetail detail) {
    const Stopwatch watch(&report_->features_seconds);
    has_coarse_features_ = ExtractFeatures(colmap_, work_, copies_, options_, detail);
  }

  void Match(const std::vector<PhotoPair>& pairs) {
    const Stopwatch watch(&report_->matching_seconds);
    MatchPairs(colmap_, work_, copies_, pairs, run_);
    report_->pairs_tried += static_cast<int64_t>(pairs.size());
  }

  void Attempt(const char* name, Strictness strictness) {
    const Stopwatch watch(&report_->mapping_seconds);
    std::optional<ColmapModel> model =
        MapPhotos(colmap_, work_, copies_.names.size(), name, strictness);
    if (!model || model->images.size() <= Placed()) return;
    best_ = std::move(model);
    is_loose_ = strictness == Strictness::kLoose;
  }

  void SolvePlanned(const PairPlan& plan) {
    Extract(FeatureDetail::kCoarse);
    Match(plan.pairs);
    Attempt("planned", Strictness::kDefault);
    if (Placed() == copies_.names.size() || IsHopeless(plan)) return;
    const std::vector<PhotoPair> more = UnregisteredPairs(PlacedPhotos(), plan.pairs);
    if (AreWorthMatching(more)) {
      colmap_.Note(
          fmt::format("{} photos found a place; matching the others with all: {} more pairs",
                      Placed(),
                      more.size()));
      Match(more);
      Attempt("widened", Strictness::kDefault);
    }
    if (!AreNearlyAllPlaced()) Attempt("straight", Strictness::kStraight);
  }

  // Skipped if finer features of all photos come next anyway; distant frames share nothing.
  bool AreWorthMatching(const std::vector<PhotoPair>& pairs) const {
    if (pairs.empty() || order_ == PhotoOrder::kSequence) return false;
    return IsHalfPlaced() || !has_coarse_features_;
  }

  void SolveExhaustively(bool has_features) {
    if (!has_features || has_coarse_features_) Extract(FeatureDetail::kFine);
    report_->exhaustive = true;
    report_->pairs_tried = 0;
    Match(AllPairs(Count()));
    Attempt("exhaustive", Strictness::kDefault);
    if (!AreNearlyAllPlaced()) Attempt("exhaustive_straight", Strictness::kStraight);
    if (!IsHalfPlaced()) Attempt("exhaustive_loose", Strictness::kLoose);
    if (is_loose_)
      colmap_.Warn("camera positions were found with loose thresholds only; check them");
  }

  std::vector<bool> PlacedPhotos() const {
    std::set<std::string> names;
    if (best_) {
      for (const auto& [id, image] : best_->images) names.insert(image.name);
    }
    std::vector<bool> placed;
    for (const std::string& name : copies_.names) placed.push_back(names.count(name) > 0);
    return placed;
  }

  ColmapProcess& colmap_;
  const SfmWorkspace& work_;
  const FeatureImages& copies_;
  const ImportOptions& options_;
  PhotoOrder order_;
  const RunControl& run_;
  SfmReport* report_;
  std::optional<ColmapModel> best_;
  bool has_coarse_features_ = false;
  bool is_loose_ = false;
};

// Runs before any step that takes minutes.
void RequireParallax(const std::vector<LocalFeatures>& features,
                     const ColmapProcess& colmap,
                     PhotoOrder order,
                     const RunControl& run) {
  const ParallaxEvidence evidence = MeasureParallax(features, run.pool, run.cancel);
  colmap.Note(Describe(evidence));
  if (!evidence.IsFromOnePlace()) return;
  if (order == PhotoOrder::kSequence) {
    throw InvalidArgument("the camera only rotates or zooms, which gives no depth: {}",
                          Describe(evidence));
  }
  throw InvalidArgument(
      "the photos were taken from one place, which gives no depth: {}. Take photos from "
      "different places, a step to the side for each (a tenth of the distance to what you "
      "photograph, or more); turning the camera or letting it stand does not help; log: {}",
      Describe(evidence),
      colmap.log().filename().string());
}

PairPlan PlanFrames(const std::vector<Photo>& photos,
                    const FeatureImages& copies,
                    const RunControl& run) {
  std::vector<int> camera;
  for (const Photo& photo : photos) camera.push_back(photo.camera);
  PairPlan plan = PairsInSequence(camera);
  const std::vector<int> compared = FramesToCompare(camera);
  if (compared.empty()) return plan;
  std::vector<LocalFeatures> features;
  for (const int frame : compared) features.push_back(copies.features[frame]);
  AddPairsAcross(camera, compared, CompareAll(features, run.pool, run.cancel), &plan);
  return plan;
}

PairPlan Plan(const std::vector<Photo>& photos,
              const FeatureImages& copies,
              const ImportOptions& options,
              PhotoOrder order,
              const RunControl& run) {
  const int count = static_cast<int>(photos.size());
  if (order == PhotoOrder::kSequence) return PlanFrames(photos, copies, run);
  if (options.sfm_pairs == SfmPairs::kExhaustive) {
    return {AllPairs(count), "all pairs, as asked for", count};
  }
  std::vector<std::string> names;
  for (const Photo& photo : photos) names.push_back(photo.name);
  return PlanPairs(CompareAll(copies.features, run.pool, run.cancel),
                   SequenceOrder(names).value_or(std::vector<int>()),
                   options.sfm_neighbors);
}

void RequirePlaced(size_t placed, size_t count, PhotoOrder order, const fs::path& log) {
  if (placed >= kMinPlaced) return;
  if (order == PhotoOrder::kSequence) {
    throw InvalidArgument(
        "{} of {} frames could be placed: they share too few static features; log: "
        "{}",
        placed == 0 ? "none" : fmt::format("only {}", placed),
        count,
        log.filename().string());
  }
  throw InvalidArgument(
      "{} of {} photos could be placed: the others share too few features with them; take at least "
      "3 sharp photos from different places that overlap by 60 %; log: {}",
      placed == 0 ? "none" : fmt::format("only {}", placed),
      count,
      log.filename().string());
}

// Converts COLMAP's cameras for the copies to cameras for the photos, and its image numbers to
// views.
SfmResult MakeScene(const ColmapModel& model,
                    const std::vector<Photo>& photos,
                    const std::vector<std::string>& copies) {
  std::map<std::string, uint32_t> image_of_copy;
  for (const auto& [id, image] : model.images) image_of_copy[image.name] = id;
  SfmResult result;
  std::map<uint32_t, int> view_of_image;
  for (size_t i = 0; i < photos.size(); ++i) {
    const auto it = image_of_copy.find(copies[i]);
    if (it == image_of_copy.end()) continue;
    const ColmapImage& image = model.images.at(it->second);
    const ColmapCamera& camera = model.cameras.at(image.camera_id);
    View view;
    view.name = photos[i].name;
    view.image_file = photos[i].file;
    view.mask_file = photos[i].mask_file;
    // The copies are already upright: no further rotation.
    view.captured_camera = camera.camera.Scaled(photos[i].width, photos[i].height);
    view.distortion = camera.distortion;
    view.camera = UndistortedCamera(view.captured_camera, view.distortion);
    view.cam_from_world = image.cam_from_world;
    view_of_image[it->second] = static_cast<int>(result.scene.views.size());
    result.scene.views.push_back(std::move(view));
  }
  for (const ColmapPoint& from : model.points) {
    result.scene.points.push_back(MakeSparsePoint(from, view_of_image));
  }
  return result;
}

// Files of an earlier, interrupted run must not be mixed with new ones.
void RemoveEarlierRun(const fs::path& scratch_folder) {
  std::error_code error;
  fs::create_directories(scratch_folder, error);
  fs::remove_all(scratch_folder / "photos", error);
  std::vector<fs::path> models;
  for (const auto& entry : fs::directory_iterator(scratch_folder)) {
    if (entry.path().filename().string().rfind("models_", 0) == 0) models.push_back(entry.path());
  }
  for (const fs::path& folder : models) fs::remove_all(folder, error);
}

}  // namespace

SfmResult RunStructureFromMotion(const std::vector<Photo>& photos,
                                 const fs::path& scene_folder,
                                 const fs::path& scratch_folder,
                                 const ImportOptions& options,
                                 const RunControl& run,
                                 PhotoOrder order) {
  RemoveEarlierRun(scratch_folder);
  const SfmWorkspace work{scratch_folder};
  SfmReport report;
  report.log = scratch_folder / "sfm.log";
  ColmapProcess colmap(report.log, options.sfm_timeout, run);
  FeatureImages copies;
  PairPlan plan;
  {
    const Stopwatch watch(&report.photos_seconds);
    copies = WriteFeatureImages(photos,
                                scene_folder,
                                work.images(),
                                work.masks(),
                                options.sfm_max_image_side_px,
                                LocalFeatureCount(photos.size()),
                                run);
    RequireParallax(copies.features, colmap, order, run);
    plan = Plan(photos, copies, options, order, run);
  }
  report.plan = plan.reason;
  colmap.Note("planned " + plan.reason);
  const ColmapModel model = Solver(colmap, work, copies, options, order, run, &report).Solve(plan);
  RequirePlaced(model.images.size(), photos.size(), order, colmap.log());
  SfmResult result = MakeScene(model, photos, copies.names);
  result.report = std::move(report);
  return result;
}

}  // namespace color3d
