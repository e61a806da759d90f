#include "core/stage/consistency_scores.h"

#include <algorithm>
#include <memory>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/raster/render.h"
#include "core/stage/artifacts.h"

namespace color3d {
namespace {

constexpr int kSidePx = 500;
constexpr int kMostPairs = 24;  // of each gap; with more views they are spread evenly
constexpr int kStridePx = 3;    // some 20 000 matches a pair; the paper's protocol takes 5 000
constexpr size_t kBatch = 8;    // pairs at once: bounds the pictures in memory

struct ViewPictures {
  PosedDepth geometry;
  ColoredPicture rendered, colored, truth;  // truth may be empty
};

struct PairScores {
  PairDifference rendered, colored, truth;
};

ColoredPicture PictureOfLab(Image lab) {
  ColoredPicture picture;
  picture.srgb = SrgbFromLab(lab);
  picture.lab = std::move(lab);
  return picture;
}

class Scorer {
 public:
  Scorer(const Scene& scene,
         const GaussianModel& model,
         const std::map<int, std::filesystem::path>& truth,
         ThreadPool& pool,
         const StageContext& context)
      : scene_(scene),
        model_(model),
        truth_(truth),
        pool_(pool),
        context_(context),
        images_(scene, context.scene_folder(), kSidePx, 0) {
    match_.stride_px = kStridePx;
  }

  ConsistencyScores Score() {
    const auto pairs = ConsistencyPairs(static_cast<int>(scene_.views.size()), kMostPairs);
    with_truth_ = std::all_of(pairs.begin(), pairs.end(), [&](const ViewPair& pair) {
      return truth_.contains(pair.first) && truth_.contains(pair.second);
    });
    ConsistencyMeter rendered, colored, truth;
    for (size_t begin = 0; begin < pairs.size(); begin += kBatch) {
      const std::vector<ViewPair> batch(pairs.begin() + begin,
                                        pairs.begin() + std::min(begin + kBatch, pairs.size()));
      Load(batch);
      std::vector<PairScores> scores(batch.size());
      pool_.ForEach(static_cast<int64_t>(batch.size()),
                    [&](int64_t i, int) { scores[i] = Compare(batch[i]); });
      for (size_t i = 0; i < batch.size(); ++i) {
        rendered.Add(batch[i], scores[i].rendered);
        colored.Add(batch[i], scores[i].colored);
        truth.Add(batch[i], scores[i].truth);
      }
    }
    ConsistencyScores result{rendered.Result(), colored.Result(), std::nullopt};
    if (with_truth_ && !pairs.empty()) result.truth = truth.Result();
    return result;
  }

 private:
  // Pairs come in order of their first view: what lies before it is not needed again.
  void Load(const std::vector<ViewPair>& batch) {
    views_.erase(views_.begin(), views_.lower_bound(batch.front().first));
    std::vector<int> missing;
    for (const ViewPair& pair : batch) {
      for (const int view : {pair.first, pair.second}) {
        if (views_.emplace(view, ViewPictures()).second) missing.push_back(view);
      }
    }
    for (const int view : missing) {
      context_.cancel().ThrowIfCancelled();
      Render(view, views_.at(view));
    }
    pool_.ForEach(static_cast<int64_t>(missing.size()),
                  [&](int64_t i, int) { ReadPictures(missing[i], views_.at(missing[i])); });
  }

  void Render(int view, ViewPictures& pictures) {
    const Pose& pose = scene_.views[view].cam_from_world;
    const Camera camera = images_.WorkingCamera(view);
    RenderedView rendered = RenderView(model_, camera, pose, pool_);
    pictures.geometry = {camera, pose, std::move(rendered.depth)};
    pictures.rendered.lab = std::move(rendered.lab);
  }

  void ReadPictures(int view, ViewPictures& pictures) const {
    pictures.rendered = PictureOfLab(std::move(pictures.rendered.lab));
    const auto luminance = images_.Luminance(view);
    pictures.colored = PictureOfLab(JoinLab(
        *luminance, ReadViewAb(context_, scene_.views[view], luminance->width, luminance->height)));
    if (!with_truth_) return;
    pictures.truth.srgb = images_.Undistort(view, ReadImage(truth_.at(view)));
    pictures.truth.lab = LabFromSrgb(pictures.truth.srgb);
  }

  PairScores Compare(const ViewPair& pair) const {
    const ViewPictures& from = views_.at(pair.first);
    const ViewPictures& to = views_.at(pair.second);
    const auto matches = MatchByGeometry(from.geometry, to.geometry, match_);
    PairScores scores;
    scores.rendered = CompareMatches(from.rendered, to.rendered, matches);
    scores.colored = CompareMatches(from.colored, to.colored, matches);
    if (with_truth_) scores.truth = CompareMatches(from.truth, to.truth, matches);
    return scores;
  }

  const Scene& scene_;
  const GaussianModel& model_;
  const std::map<int, std::filesystem::path>& truth_;
  ThreadPool& pool_;
  const StageContext& context_;
  ViewImages images_;
  MatchOptions match_;
  bool with_truth_ = false;
  std::map<int, ViewPictures> views_;
};

}  // namespace

ConsistencyScores ScoreConsistency(const Scene& scene,
                                   const GaussianModel& model,
                                   const std::map<int, std::filesystem::path>& truth,
                                   ThreadPool& pool,
                                   const StageContext& context) {
  return Scorer(scene, model, truth, pool, context).Score();
}

}  // namespace color3d
