#include "core/film/film_carry.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/base/mutex.h"
#include "core/base/range_check.h"
#include "core/carry/confidence.h"
#include "core/film/frame_motion.h"
#include "core/image/box_mean.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

constexpr int kWindowRadius = 3;
constexpr float kMinConfidence = 0.02f;

// Extends the track along the flow to the next frame and back.
FilmTrack Step(const FilmTrack& track, const Image& there, const Image& back) {
  FilmTrack further{SampledAt(track.in_key, MovedPositions(back)), track.in_frame};
  const Image step = SampledAt(there, track.in_frame);
  for (size_t i = 0; i < step.data.size(); ++i) further.in_frame.data[i] += step.data[i];
  return further;
}

// L relative to its surroundings, independent of exposure and contrast.
Image LocalContrast(const Image& luminance) {
  constexpr int kRadius = 7;
  constexpr float kGrain = 4.0f;  // variance of grain, L^2
  const Image mean = BoxMean(luminance, kRadius);
  Image out(luminance.width, luminance.height, 1), square = out;
  for (size_t i = 0; i < out.data.size(); ++i) {
    out.data[i] = luminance.data[i] - mean.data[i];
    square.data[i] = out.data[i] * out.data[i];
  }
  const Image variance = BoxMean(square, kRadius);
  for (size_t i = 0; i < out.data.size(); ++i) {
    out.data[i] /= std::sqrt(std::max(0.0f, variance.data[i]) + kGrain);
  }
  return out;
}

// Mean difference of two pictures of local contrast around each pixel, 0..2.
Image LocalDifference(const Image& one, const Image& other) {
  Image difference(one.width, one.height, 1);
  for (size_t i = 0; i < difference.data.size(); ++i) {
    difference.data[i] = std::min(2.0f, std::abs(one.data[i] - other.data[i]));
  }
  return BoxMean(difference, kWindowRadius);
}

// Corrects drift: moves `place` along the flow between a picture and the other one warped to it,
// where that makes them more alike.
void Register(const Image& picture,
              const Image& contrast,
              const Image& other,
              const Image& other_contrast,
              Image* place) {
  constexpr float kMaxPx = 6.0f;  // a longer flow is no drift
  constexpr float kMinGain = 0.02f;
  Image rest = DenseFlow(picture, SampledAt(other, *place));
  for (size_t i = 0; i < rest.PlaneSize(); ++i) {
    float& x = rest.Plane(0)[i];
    float& y = rest.Plane(1)[i];
    if (x * x + y * y > kMaxPx * kMaxPx) x = y = 0.0f;
  }
  const Image registered = SampledAt(*place, MovedPositions(std::move(rest)));
  const Image before = LocalDifference(contrast, SampledAt(other_contrast, *place));
  const Image after = LocalDifference(contrast, SampledAt(other_contrast, registered));
  for (size_t i = 0; i < before.data.size(); ++i) {
    if (after.data[i] >= before.data[i] - kMinGain) continue;
    for (int c = 0; c < 2; ++c) place->Plane(c)[i] = registered.Plane(c)[i];
  }
}

bool Inside(float x, float y, int width, int height) {
  return x >= -0.5f && y >= -0.5f && x <= static_cast<float>(width) - 0.5f &&
         y <= static_cast<float>(height) - 0.5f;
}

// Confidence that the pixels of a picture lie at `place` in another one, 0..1. `back` leads from
// there to the picture.
Image TrackConfidence(const Image& place,
                      const Image& back,
                      const Image& contrast,
                      const Image& other_contrast,
                      const FilmCarryOptions& options) {
  const Image unlike = LocalDifference(contrast, SampledAt(other_contrast, place));
  const Image returned = SampledAt(back, place);
  const int width = contrast.width, height = contrast.height;
  const double inverse_square_tolerance =
      1.0 / (options.cycle_tolerance_px * options.cycle_tolerance_px);
  Image confidence(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!Inside(place.At(0, y, x), place.At(1, y, x), width, height)) continue;
      const double dx = returned.At(0, y, x) - static_cast<float>(x);
      const double dy = returned.At(1, y, x) - static_cast<float>(y);
      const double closed = 1.0 / (1.0 + (dx * dx + dy * dy) * inverse_square_tolerance);
      const double excess = unlike.At(0, y, x) - options.unlikeness;
      const double like = excess > 0.0 ? std::exp(-excess / options.unlikeness) : 1.0;
      confidence.At(0, y, x) = static_cast<float>(closed * closed * like);
    }
  }
  return confidence;
}

// Correspondences of a picture's pixels in another one, with their confidence.
struct Correspondences {
  Image place;
  Image confidence;
};

void ReplaceLessConfident(const Correspondences& found, Correspondences* followed) {
  constexpr float kMinGain = 0.3f;  // of confidence
  for (size_t i = 0; i < found.confidence.data.size(); ++i) {
    if (found.confidence.data[i] <
        std::max(kDecisiveConfidence, followed->confidence.data[i] + kMinGain)) {
      continue;
    }
    followed->confidence.data[i] = found.confidence.data[i];
    for (int c = 0; c < 2; ++c) followed->place.Plane(c)[i] = found.place.Plane(c)[i];
  }
}

constexpr double kMaxLoss = 0.1;
constexpr double kWellTracked = 0.9;  // mean confidence from which features are not matched

double MeanValue(const Image& image) {
  const double sum = std::accumulate(image.data.begin(), image.data.end(), 0.0);
  return sum / static_cast<double>(image.data.size());
}

// Takes the tracks that features find, where they are more confident than flow.
void UseReappearingTracks(const ReappearingRegions& regions,
                          const Image& frame,
                          const Image& contrast,
                          const Image& key_contrast,
                          const FilmCarryOptions& options,
                          const CancellationToken& cancel,
                          FilmTrack* track) {
  const auto in_key = [&](const FilmTrack& t) {
    return Correspondences{t.in_key,
                           TrackConfidence(t.in_key, t.in_frame, contrast, key_contrast, options)};
  };
  const auto in_frame = [&](const FilmTrack& t) {
    return Correspondences{t.in_frame,
                           TrackConfidence(t.in_frame, t.in_key, key_contrast, contrast, options)};
  };
  Correspondences of_frame = in_key(*track);
  if (MeanValue(of_frame.confidence) > kWellTracked) return;
  Correspondences of_key = in_frame(*track);
  for (const FilmTrack& other : regions.TracksTo(frame, cancel)) {
    cancel.ThrowIfCancelled();
    ReplaceLessConfident(in_key(other), &of_frame);
    ReplaceLessConfident(in_frame(other), &of_key);
  }
  *track = {std::move(of_frame.place), std::move(of_key.place)};
}

CarriedColor SampleKeyColor(const FilmKey& key,
                            const Image& key_contrast,
                            const Image& contrast,
                            const FilmTrack& track,
                            const FilmCarryOptions& options) {
  CarriedColor color{SampledAt(key.color.ab, track.in_key),
                     SampledAt(key.color.confidence, track.in_key)};
  const Image followed =
      TrackConfidence(track.in_key, track.in_frame, contrast, key_contrast, options);
  for (size_t i = 0; i < followed.data.size(); ++i) {
    float& confidence = color.confidence.data[i];
    confidence *= followed.data[i];
    if (confidence > kMinConfidence) continue;
    confidence = 0.0f;
    for (int c = 0; c < color.ab.channels; ++c) color.ab.Plane(c)[i] = 0.0f;
  }
  return color;
}

// A walk away from a key frame over the frames that it colours.
struct Walk {
  const FilmKey* key = nullptr;
  int direction = 1;
  std::vector<int> frames;  // in the order of the walk
  size_t nearest = 0;       // number of the first ones, to which no key frame is nearer
  FilmWalk before;          // track null: the walk begins at the key frame

  void Drop(size_t count) {
    frames.erase(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(count));
    nearest -= std::min(nearest, count);
  }
};

// Goes along a walk frame by frame.
class Walker {
 public:
  Walker(const Walk& walk,
         const FilmFrames& frames,
         const FilmCarryOptions& options,
         const CancellationToken& cancel)
      : walk_(walk),
        frames_(frames),
        options_(options),
        cancel_(cancel),
        key_(frames.luminance(walk.key->frame)),
        key_contrast_(LocalContrast(*key_)),
        frame_(walk.key->frame),
        luminance_(key_),
        moved_(walk.before.moved),
        wanted_(walk.before.wanted),
        track_(walk.before.track) {
    if (options.correct_after < 1.0) regions_.emplace(*key_);
    if (track_) {
      frame_ = walk.before.frame;
      luminance_ = frames.luminance(frame_);
    } else {
      const Image start = MovedPositions(Image(key_->width, key_->height, 2));
      wanted_ = MeanValue(walk.key->color.confidence) - kMaxLoss;
      track_ = std::make_shared<const FilmTrack>(FilmTrack{start, start});
    }
  }

  CarriedColor CarryTo(int frame) {
    cancel_.ThrowIfCancelled();
    const auto next = frames_.luminance(frame);
    const Image contrast = LocalContrast(*next);
    const auto flow = FlowTo(frame, *next);
    const bool forward = walk_.direction > 0;
    FilmTrack track =
        forward ? Step(*track_, flow->forth, flow->back) : Step(*track_, flow->back, flow->forth);
    const auto color = [&] {
      return SampleKeyColor(*walk_.key, key_contrast_, contrast, track, options_);
    };
    CarriedColor carried = color();
    if (regions_) {
      moved_ += MotionOf(flow->back);
      const bool in_turn = moved_ >= options_.correct_after;
      if (in_turn || MeanValue(carried.confidence) < wanted_) {
        Correct(*next, contrast, &track);
        carried = color();
      }
      if (in_turn) {
        moved_ = 0.0;
        wanted_ = MeanValue(carried.confidence) - kMaxLoss;
      }
    }
    frame_ = frame;
    luminance_ = next;
    track_ = std::make_shared<const FilmTrack>(std::move(track));
    return carried;
  }

  FilmWalk State() const {
    const bool ends = frame_ == walk_.frames.back();
    return {walk_.key->frame, walk_.direction, frame_, moved_, wanted_, ends ? nullptr : track_};
  }

 private:
  std::shared_ptr<const FlowPair> FlowTo(int frame, const Image& next) const {
    const bool forward = walk_.direction > 0;
    if (frames_.flow) return frames_.flow(forward ? frame_ : frame, forward ? frame : frame_);
    const Image& earlier = forward ? *luminance_ : next;
    const Image& later = forward ? next : *luminance_;
    return std::make_shared<const FlowPair>(
        FlowPair{DenseFlow(earlier, later), DenseFlow(later, earlier)});
  }

  void Correct(const Image& next, const Image& contrast, FilmTrack* track) const {
    cancel_.ThrowIfCancelled();
    Register(next, contrast, *key_, key_contrast_, &track->in_key);
    cancel_.ThrowIfCancelled();
    Register(*key_, key_contrast_, next, contrast, &track->in_frame);
    cancel_.ThrowIfCancelled();
    UseReappearingTracks(*regions_, next, contrast, key_contrast_, options_, cancel_, track);
  }

  const Walk& walk_;
  const FilmFrames& frames_;
  const FilmCarryOptions& options_;
  const CancellationToken& cancel_;
  const std::shared_ptr<const Image> key_;
  const Image key_contrast_;
  std::optional<ReappearingRegions> regions_;
  int frame_;
  std::shared_ptr<const Image> luminance_;  // of the frame
  double moved_;
  double wanted_;
  std::shared_ptr<const FilmTrack> track_;
};

// Drops the frames that are done.
void DropFinished(const std::vector<FilmWalk>& walks, Walk* walk) {
  for (const FilmWalk& done : walks) {
    if (done.key != walk->key->frame || done.direction != walk->direction) continue;
    const auto last = std::find(walk->frames.begin(), walk->frames.end(), done.frame);
    if (last == walk->frames.end()) return;  // a walk of other key frames
    if (!done.track && last + 1 != walk->frames.end()) return;
    walk->Drop(static_cast<size_t>(last - walk->frames.begin()) + 1);
    walk->before = done;
  }
}

std::vector<Walk> PlanWalks(const FilmFrames& frames,
                            const std::vector<FilmKey>& keys,
                            bool with_second,
                            const std::vector<FilmWalk>& done) {
  const int count = static_cast<int>(frames.shot.size());
  std::vector<int> key_frames;
  for (const FilmKey& key : keys) key_frames.push_back(key.frame);
  const std::vector<NearKeyFrames> near = NearestKeyFrames(frames, key_frames);
  std::vector<Walk> walks;
  for (const FilmKey& key : keys) {
    for (const int direction : {1, -1}) {
      Walk walk{&key, direction, {}, 0, {}};
      for (int i = key.frame + direction; i >= 0 && i < count; i += direction) {
        // Frames with faults may lie between the frames of a shot.
        const bool is_nearest = near[i].nearest == key.frame;
        if (!is_nearest && !(with_second && near[i].second == key.frame)) continue;
        walk.frames.push_back(i);
        if (is_nearest) walk.nearest = walk.frames.size();
      }
      DropFinished(done, &walk);
      if (!walk.frames.empty()) walks.push_back(std::move(walk));
    }
  }
  // The longest walks first, so that threads end together.
  std::stable_sort(walks.begin(), walks.end(), [](const Walk& x, const Walk& y) {
    return x.frames.size() > y.frames.size();
  });
  return walks;
}

}  // namespace

std::vector<NearKeyFrames> NearestKeyFrames(const FilmFrames& frames,
                                            const std::vector<int>& keys) {
  constexpr double kSameTime = 1e-6;  // times are not exact
  const auto distance = [&](int a, int b) {
    return frames.time_s.empty() ? std::abs(a - b) : std::abs(frames.time_s[a] - frames.time_s[b]);
  };
  const auto nearest_but = [&](int except, int frame) {
    int nearest = -1;
    for (const int key : keys) {
      if (key == except || frames.shot[key] != frames.shot[frame]) continue;
      if (nearest < 0 || distance(key, frame) < distance(nearest, frame) - kSameTime) nearest = key;
    }
    return nearest;
  };
  std::vector<NearKeyFrames> near(frames.shot.size());
  for (size_t i = 0; i < near.size(); ++i) {
    const int frame = static_cast<int>(i);
    near[i].nearest = nearest_but(-1, frame);
    near[i].second = nearest_but(near[i].nearest, frame);
  }
  return near;
}

CarriedColor CarryIntoReappearing(const FilmKey& key,
                                  const ReappearingRegions& regions,
                                  const Image& frame,
                                  const FilmCarryOptions& options,
                                  const CancellationToken& cancel) {
  constexpr float kOutside = -1e4f;
  const Image contrast = LocalContrast(frame), key_contrast = LocalContrast(regions.key());
  const Image outside(frame.width, frame.height, 2, kOutside);
  FilmTrack track{outside, outside};
  UseReappearingTracks(regions, frame, contrast, key_contrast, options, cancel, &track);
  return SampleKeyColor(key, key_contrast, contrast, track, options);
}

void FilmCarryOptions::Validate() const {
  const RangeCheck check("film carry option");
  check("cycle_tolerance_px", cycle_tolerance_px, 0.1, 20);
  check("unlikeness", unlikeness, 0.05, 2);
  check("correct_after", correct_after, 0, 1);
}

void CarryAlongFilm(const FilmFrames& frames,
                    const std::vector<FilmKey>& keys,
                    const FilmCarryOptions& options,
                    ThreadPool& pool,
                    const CancellationToken& cancel,
                    const FilmCarrySinks& sinks,
                    const FilmResume& resume) {
  options.Validate();
  for (size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].frame < 0 || keys[i].frame >= static_cast<int>(frames.shot.size())) {
      throw InvalidArgument("key frame {} is out of range; the film has {} frames",
                            keys[i].frame,
                            frames.shot.size());
    }
    for (size_t k = 0; k < i; ++k) {
      if (keys[k].frame == keys[i].frame) {
        throw InvalidArgument("frame {} is given as key frame twice", keys[i].frame);
      }
    }
  }
  for (const FilmKey& key : keys) sinks.on_frame(key.frame, key.color);
  Mutex handing_over;
  const auto go = [&](size_t count, const OnCarriedFrame& to, Walk* walk) {
    if (count == 0) return;
    Walker walker(*walk, frames, options, cancel);
    for (size_t i = 0; i < count; ++i) {
      const int frame = walk->frames[i];
      const CarriedColor color = walker.CarryTo(frame);
      const MutexLock lock(handing_over);
      if (resume.on_walk) resume.on_walk(walker.State());
      to(frame, color);
    }
    walk->before = walker.State();
    walk->Drop(count);
  };
  std::vector<Walk> walks = PlanWalks(frames, keys, sinks.on_second != nullptr, resume.walks);
  const auto count = static_cast<int64_t>(walks.size());
  pool.ForEach(count, [&](int64_t i, int) { go(walks[i].nearest, sinks.on_frame, &walks[i]); });
  pool.ForEach(count,
               [&](int64_t i, int) { go(walks[i].frames.size(), sinks.on_second, &walks[i]); });
}

}  // namespace color3d
