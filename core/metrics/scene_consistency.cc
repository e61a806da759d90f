#include "core/metrics/scene_consistency.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/metrics/flow_matches.h"

namespace color3d {
namespace {

constexpr int kMaxPairs = 24;  // for each gap, evenly spread
constexpr int kStridePx = 3;   // about 20,000 matches a pair; the protocol of the paper uses 5,000
constexpr size_t kBatch = 8;   // pairs at a time: bounds the pictures in memory

struct ViewPictures {
  PosedDepth geometry;
  ColoredPicture rendered, colored, truth;  // truth may be empty
};

struct PairScores {
  PairDifference rendered, colored, truth;
};

struct Meters {
  ConsistencyMeter rendered, colored, truth;

  void Add(const ViewPair& pair, const PairScores& scores) {
    rendered.Add(pair, scores.rendered);
    colored.Add(pair, scores.colored);
    truth.Add(pair, scores.truth);
  }
};

ColoredPicture PictureOfLab(Image lab) {
  ColoredPicture picture;
  picture.srgb = SrgbFromLab(lab);
  picture.lab = std::move(lab);
  return picture;
}

class Scorer {
 public:
  Scorer(const ConsistencySource& source, ThreadPool& pool, const CancellationToken& cancel)
      : source_(source), pool_(pool), cancel_(cancel) {
    match_.stride_px = kStridePx;
  }

  SceneConsistency Score() {
    const auto pairs = ConsistencyPairs(source_.groups, kMaxPairs);
    const int views = std::accumulate(source_.groups.begin(), source_.groups.end(), 0);
    for (int view = 0; view < views; ++view) with_common_ |= source_.has_truth(view);
    with_truth_ = std::all_of(pairs.begin(), pairs.end(), [&](const ViewPair& pair) {
      return source_.has_truth(pair.first) && source_.has_truth(pair.second);
    });
    Meters own, common;
    for (size_t begin = 0; begin < pairs.size(); begin += kBatch) {
      const std::vector<ViewPair> batch(pairs.begin() + begin,
                                        pairs.begin() + std::min(begin + kBatch, pairs.size()));
      Load(batch);
      std::vector<PairScores> scores(batch.size()), common_scores(batch.size());
      pool_.ForEach(static_cast<int64_t>(batch.size()), [&](int64_t i, int) {
        scores[i] = Compare(batch[i], MatchedByGeometry(batch[i]));
        if (with_common_) common_scores[i] = Compare(batch[i], MatchedByFlow(batch[i]));
      });
      for (size_t i = 0; i < batch.size(); ++i) {
        own.Add(batch[i], scores[i]);
        common.Add(batch[i], common_scores[i]);
      }
    }
    SceneConsistency result{
        own.rendered.Result(), own.colored.Result(), std::nullopt, std::nullopt};
    if (pairs.empty()) return result;
    if (with_common_) {
      result.common =
          SceneConsistency::Common{common.rendered.Result(), common.colored.Result(), std::nullopt};
    }
    if (with_truth_) {
      result.truth = own.truth.Result();
      result.common->truth = common.truth.Result();
    }
    return result;
  }

 private:
  // Pairs are ordered by their first view: earlier views are not needed again.
  void Load(const std::vector<ViewPair>& batch) {
    views_.erase(views_.begin(), views_.lower_bound(batch.front().first));
    std::vector<int> missing;
    for (const ViewPair& pair : batch) {
      for (const int view : {pair.first, pair.second}) {
        if (views_.emplace(view, ViewPictures()).second) missing.push_back(view);
      }
    }
    for (const int view : missing) {
      cancel_.ThrowIfCancelled();
      ConsistencySource::Rendered rendered = source_.render(view);
      views_.at(view).geometry = std::move(rendered.geometry);
      views_.at(view).rendered.lab = std::move(rendered.lab);
    }
    pool_.ForEach(static_cast<int64_t>(missing.size()),
                  [&](int64_t i, int) { FetchPictures(missing[i], views_.at(missing[i])); });
  }

  void FetchPictures(int view, ViewPictures& pictures) const {
    pictures.rendered = PictureOfLab(std::move(pictures.rendered.lab));
    pictures.colored = PictureOfLab(source_.colored_lab(view));
    if (!with_truth_) return;
    pictures.truth.srgb = source_.true_srgb(view);
    pictures.truth.lab = LabFromSrgb(pictures.truth.srgb);
  }

  std::vector<PixelMatch> MatchedByGeometry(const ViewPair& pair) const {
    return MatchByGeometry(views_.at(pair.first).geometry, views_.at(pair.second).geometry, match_);
  }

  std::vector<PixelMatch> MatchedByFlow(const ViewPair& pair) const {
    return MatchByFlow(LuminanceOfLab(views_.at(pair.first).colored.lab),
                       LuminanceOfLab(views_.at(pair.second).colored.lab),
                       kStridePx);
  }

  PairScores Compare(const ViewPair& pair, const std::vector<PixelMatch>& matches) const {
    const ViewPictures& from = views_.at(pair.first);
    const ViewPictures& to = views_.at(pair.second);
    PairScores scores;
    scores.rendered = CompareMatches(from.rendered, to.rendered, matches);
    scores.colored = CompareMatches(from.colored, to.colored, matches);
    if (with_truth_) scores.truth = CompareMatches(from.truth, to.truth, matches);
    return scores;
  }

  const ConsistencySource& source_;
  ThreadPool& pool_;
  const CancellationToken& cancel_;
  MatchOptions match_;
  bool with_truth_ = false;   // of all pairs
  bool with_common_ = false;  // the scene has any truth
  std::map<int, ViewPictures> views_;
};

}  // namespace

SceneConsistency MeasureConsistency(const ConsistencySource& source,
                                    ThreadPool& pool,
                                    const CancellationToken& cancel) {
  return Scorer(source, pool, cancel).Score();
}

}  // namespace color3d
