#include "core/stage/sources/picture_carry.h"

#include <algorithm>
#include <map>
#include <utility>

#include "core/carry/confidence.h"
#include "core/image/feature_matches.h"
#include "core/stage/formats/edited_share.h"

namespace color3d {
namespace {

// Shares of a picture that are reached: less is taken for a chance; with more its colours are
// carried on.
constexpr double kMinReached = 0.05;
constexpr double kReached = 0.4;
constexpr int kRounds = 3;         // from picture to picture
constexpr size_t kMaxSources = 4;  // of a picture, and of a round but the first
constexpr int kRankingFeatures = 500;
constexpr size_t kBatch = 16;  // pictures whose sources are in memory together

// Pictures of any shape in the middle of a square of equal size, so that they compare like frames.
class Canvas {
 public:
  explicit Canvas(int side_px) : side_px_(side_px) {}

  Image Put(const Image& picture, float outside) const {
    Image canvas(side_px_, side_px_, picture.channels, outside);
    const auto [left, top] = Place(picture.width, picture.height);
    for (int c = 0; c < picture.channels; ++c) {
      for (int y = 0; y < picture.height; ++y) {
        const float* row = picture.Plane(c) + static_cast<size_t>(y) * picture.width;
        std::copy_n(
            row, picture.width, canvas.Plane(c) + static_cast<size_t>(y + top) * side_px_ + left);
      }
    }
    return canvas;
  }
  Image Take(const Image& canvas, int width, int height) const {
    Image picture(width, height, canvas.channels);
    const auto [left, top] = Place(width, height);
    for (int c = 0; c < canvas.channels; ++c) {
      for (int y = 0; y < height; ++y) {
        const float* row = canvas.Plane(c) + static_cast<size_t>(y + top) * side_px_ + left;
        std::copy_n(row, width, picture.Plane(c) + static_cast<size_t>(y) * width);
      }
    }
    return picture;
  }
  Image PutLuminance(const Image& luminance) const { return Put(luminance, 50.0f); }

 private:
  std::pair<int, int> Place(int width, int height) const {
    return {(side_px_ - width) / 2, (side_px_ - height) / 2};
  }
  int side_px_;
};

// A coloured picture from which others take colours, on the canvas.
class Source {
 public:
  Source(const CarriedColor& color, const Image& luminance, const Canvas& canvas)
      : key_{0, {canvas.Put(color.ab, 0.0f), canvas.Put(color.confidence, 0.0f)}},
        luminance_(canvas.PutLuminance(luminance)),
        regions_(luminance_) {}

  CarriedColor CarryInto(const Image& luminance,
                         const FilmCarryOptions& options,
                         const CancellationToken& cancel) const {
    return CarryIntoReappearing(key_, regions_, luminance, options, cancel);
  }

 private:
  FilmKey key_;
  Image luminance_;
  ReappearingRegions regions_;  // of luminance_
};

// Keeps the colour compressed, so that memory does not grow with the number of photos.
std::function<CarriedColor()> Compressed(const CarriedColor& color) {
  return [png = EncodeCarriedPng(color)] { return DecodeCarriedPng(png, "a carried colour"); };
}

}  // namespace

PictureCarry::PictureCarry(const ViewImages& images,
                           int count,
                           int channels,
                           const FilmCarryOptions& options,
                           StageContext& context)
    : images_(images), channels_(channels), options_(options), context_(context), known_(count) {
  for (int i = 0; i < count; ++i) {
    const Camera camera = images.WorkingCamera(i);
    side_px_ = std::max({side_px_, camera.width, camera.height});
  }
}

void PictureCarry::Set(int picture, const CarriedColor& color) {
  SetReader(picture, Compressed(color));
}

void PictureCarry::SetReader(int picture, std::function<CarriedColor()> read) {
  known_[picture] = {std::move(read), 1.0};
}

CarriedColor PictureCarry::ColorOf(int picture) const {
  if (known_[picture].read) return known_[picture].read();
  const Camera camera = images_.WorkingCamera(picture);
  return {Image(camera.width, camera.height, channels_), Image(camera.width, camera.height, 1)};
}

void PictureCarry::Run(std::vector<int> sources,
                       const std::function<void(size_t pictures)>& on_round) {
  for (int round = 0; round < kRounds && !sources.empty(); ++round) {
    std::vector<int> targets;
    for (size_t i = 0; i < known_.size(); ++i) {
      if (known_[i].reached < kReached) targets.push_back(static_cast<int>(i));
    }
    if (targets.empty()) return;
    on_round(targets.size());
    CarryInto(targets, sources);
    sources.clear();
    for (const int picture : targets) {
      if (known_[picture].reached >= kReached) sources.push_back(picture);
    }
    std::ranges::stable_sort(
        sources, std::ranges::greater(), [&](int picture) { return known_[picture].reached; });
    sources.resize(std::min(sources.size(), kMaxSources));
  }
}

std::vector<std::vector<int>> PictureCarry::NearestSources(const std::vector<int>& targets,
                                                           const std::vector<int>& sources) const {
  if (sources.size() <= kMaxSources) {
    return std::vector<std::vector<int>>(targets.size(), sources);
  }
  const auto features_of = [&](const std::vector<int>& pictures) {
    std::vector<LocalFeatures> features(pictures.size());
    context_.pool().ForEach(std::ssize(pictures), [&](int64_t i, int) {
      context_.ThrowIfCancelled();
      Image gray = *images_.Luminance(pictures[i]);
      for (float& value : gray.data) value *= 0.01f;
      features[i] = DetectLocalFeatures(gray, kRankingFeatures);
    });
    return features;
  };
  const std::vector<LocalFeatures> of_targets = features_of(targets);
  const std::vector<LocalFeatures> of_sources = features_of(sources);
  std::vector<std::vector<int>> nearest(targets.size());
  context_.pool().ForEach(std::ssize(targets), [&](int64_t i, int) {
    context_.ThrowIfCancelled();
    std::vector<std::pair<size_t, int>> ranking;  // matches in common, source
    for (size_t k = 0; k < sources.size(); ++k) {
      ranking.emplace_back(MutualMatches(of_targets[i], of_sources[k]).size(), sources[k]);
    }
    std::ranges::stable_sort(ranking, std::ranges::greater(), &std::pair<size_t, int>::first);
    for (size_t k = 0; k < kMaxSources; ++k) nearest[i].push_back(ranking[k].second);
  });
  return nearest;
}

void PictureCarry::CarryInto(const std::vector<int>& targets, const std::vector<int>& sources) {
  const Canvas canvas(side_px_);
  const std::vector<std::vector<int>> nearest = NearestSources(targets, sources);
  for (size_t begin = 0; begin < targets.size(); begin += kBatch) {
    const size_t end = std::min(begin + kBatch, targets.size());
    std::map<int, std::unique_ptr<const Source>> ready;
    for (size_t i = begin; i < end; ++i) {
      for (const int source : nearest[i]) ready[source];
    }
    std::vector<std::pair<const int, std::unique_ptr<const Source>>*> to_make;
    for (auto& entry : ready) to_make.push_back(&entry);
    context_.pool().ForEach(std::ssize(to_make), [&](int64_t i, int) {
      context_.ThrowIfCancelled();
      auto& [picture, source] = *to_make[i];
      source =
          std::make_unique<const Source>(ColorOf(picture), *images_.Luminance(picture), canvas);
    });
    context_.pool().ForEach(static_cast<int64_t>(end - begin), [&](int64_t offset, int) {
      const size_t i = begin + offset;
      const int picture = targets[i];
      const auto own = images_.Luminance(picture);
      const Image luminance = canvas.PutLuminance(*own);
      CarriedColor best = ColorOf(picture);
      for (const int source : nearest[i]) {
        context_.ThrowIfCancelled();
        const CarriedColor found =
            ready.at(source)->CarryInto(luminance, options_, context_.cancel());
        const CarriedColor color{canvas.Take(found.ab, own->width, own->height),
                                 canvas.Take(found.confidence, own->width, own->height)};
        if (Coverage(color, kDecisiveConfidence) < kMinReached) continue;
        KeepMoreConfident(color, &best);
      }
      const double reached = Coverage(best, kDecisiveConfidence);
      if (reached >= kMinReached) known_[picture] = {Compressed(best), reached};
    });
  }
}

}  // namespace color3d
