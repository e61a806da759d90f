#include "core/stage/film/color_frames.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/carry/confidence.h"
#include "core/film/anchor_frames.h"
#include "core/film/film_carry.h"
#include "core/stage/film/between_anchors.h"
#include "core/stage/film/frames_of_views.h"
#include "core/stage/film/steady_frames.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace {

constexpr int64_t kStretchBytes = int64_t{128} << 20;
constexpr int64_t kBytesPerPixel = 17 * sizeof(float);  // of a frame: colours, flow, two propagated

// The frames of one shot and the anchors among them, in order of time.
struct ShotToColor {
  std::vector<int> frames;
  std::vector<int> anchors;

  bool IsAnchor(int frame) const { return std::ranges::binary_search(anchors, frame); }
  // The last anchor up to a frame and the first one after it; -1 where there is none.
  int AnchorUpTo(int frame) const {
    const auto next = std::ranges::upper_bound(anchors, frame);
    return next == anchors.begin() ? -1 : *(next - 1);
  }
  int AnchorBehind(int frame) const {
    const auto next = std::ranges::upper_bound(anchors, frame);
    return next == anchors.end() ? -1 : *next;
  }
};

constexpr double kWorthGuessing = 0.02;  // least guessed share of an anchor

double ShareGuessed(const FusedColor& color) {
  const float* guessed = color.provenance.Plane(kGuessedPlane);
  const auto pixels = static_cast<std::ptrdiff_t>(color.provenance.PlaneSize());
  return std::accumulate(guessed, guessed + pixels, 0.0) / static_cast<double>(pixels);
}

// The frames between two anchors, as indices within a stretch.
struct Gap {
  size_t begin = 0;
  size_t end = 0;
};

using Flow = std::function<std::shared_ptr<const FlowPair>(int earlier, int later)>;

struct FilmToColor {
  const Scene& scene;
  const ViewImages& images;
  std::vector<int> view_of_frame;
  FilmFrames frames;
  std::vector<NearKeyFrames> near;  // of each frame
};

// Colours one shot by stretches, runs of frames that end at an anchor or with the shot. Colours do
// not depend on the length of stretches.
class ShotColorer {
 public:
  ShotColorer(const ShotToColor& shot,
              const FilmToColor& film,
              const FrameColoring& coloring,
              StageContext& context)
      : shot_(shot),
        film_(film),
        coloring_(coloring),
        context_(context),
        steady_(film.near, [this](int frame) { return WasDone(frame); }) {}

  void Run() {
    size_t begin = FirstUncoloredFrame();
    while (begin < shot_.frames.size()) {
      const size_t end = EndOfStretch(begin);
      Color({shot_.frames.begin() + static_cast<std::ptrdiff_t>(begin),
             shot_.frames.begin() + static_cast<std::ptrdiff_t>(end)});
      begin = end;
      steady_.Deliver(
          end == shot_.frames.size(), context_, [&](int frame, const FusedColor& color) {
            coloring_.deliver(film_.view_of_frame[frame], color);
          });
    }
  }

 private:
  bool WasDone(int frame) const { return coloring_.was_done(film_.view_of_frame[frame]); }

  // An interrupted run resumes at the last anchor before all frames that are left.
  size_t FirstUncoloredFrame() const {
    const auto begin = shot_.frames.begin();
    const auto open =
        std::ranges::find_if(shot_.frames, [&](int frame) { return !WasDone(frame); });
    if (open == shot_.frames.end()) return shot_.frames.size();
    if (open - begin < steady_.reach()) return 0;
    const int anchor = shot_.AnchorUpTo(*(open - steady_.reach()));
    return anchor < 0 ? 0 : std::lower_bound(begin, open, anchor) - begin;
  }

  size_t EndOfStretch(size_t begin) const {
    const auto luminance = film_.frames.luminance(shot_.frames[begin]);
    const auto at_once = static_cast<size_t>(
        kStretchBytes / (kBytesPerPixel * static_cast<int64_t>(luminance->PlaneSize())));
    size_t end = begin;
    for (size_t i = begin; i < shot_.frames.size(); ++i) {
      const bool may_end = shot_.IsAnchor(shot_.frames[i]) || i + 1 == shot_.frames.size();
      if (!may_end) continue;
      if (end > begin && i + 1 - begin > at_once) break;
      end = i + 1;
    }
    return end;
  }

  void Color(const std::vector<int>& stretch) {
    const auto index_of = [&](int frame) {
      return std::ranges::lower_bound(stretch, frame) - stretch.begin();
    };
    const auto count = std::ssize(stretch);
    ThreadPool& pool = context_.pool();
    std::vector<SteadyFrames::Frame> colored(stretch.size());
    pool.ForEach(count, [&](int64_t i, int) {
      context_.ThrowIfCancelled();
      colored[i].frame = stretch[i];
      const int last = i > 0 ? stretch[i - 1] : last_;
      if (last < 0) return;
      colored[i].flow_from_last =
          FlowBetween(*film_.frames.luminance(last), *film_.frames.luminance(stretch[i]));
    });
    std::vector<FilmKey> keys;
    if (last_anchor_) keys.push_back(std::move(*last_anchor_));
    const size_t first_new = keys.size();
    for (const int frame : stretch) {
      if (shot_.IsAnchor(frame)) keys.push_back({frame, {}});
    }
    pool.ForEach(static_cast<int64_t>(keys.size() - first_new), [&](int64_t i, int) {
      FilmKey& key = keys[first_new + i];
      FusedColor& color = colored[index_of(key.frame)].color;
      color = ColorOf(key.frame, nullptr);
      key = AnchorAsKey(key.frame, color);
    });
    for (const SteadyFrames::Frame& one : colored) {
      if (!one.color.ab.Empty() && ShareGuessed(one.color) > kWorthGuessing) {
        guessed_.insert(one.frame);
      }
    }
    std::vector<CarriedColor> before(stretch.size()), behind(stretch.size());
    const Flow flow = [&](int, int later) { return colored[index_of(later)].flow_from_last; };
    pool.ForEach(2 * std::ssize(keys), [&](int64_t i, int) {
      const FilmKey& key = keys[i / 2];
      const bool forward = i % 2 == 0;
      std::vector<int> way;
      for (const int frame : stretch) {
        if (shot_.IsAnchor(frame)) continue;
        const int owner = forward ? shot_.AnchorUpTo(frame) : shot_.AnchorBehind(frame);
        if (owner == key.frame) way.push_back(frame);
      }
      Propagate(key, way, flow, [&](int frame, const CarriedColor& color) {
        (forward ? before : behind)[index_of(frame)] = color;
      });
    });
    std::vector<CarriedColor> of_anchors(stretch.size());
    pool.ForEach(count, [&](int64_t i, int) {
      const int from = shot_.AnchorUpTo(stretch[i]), to = shot_.AnchorBehind(stretch[i]);
      const double place =
          from >= 0 && to >= 0 ? static_cast<double>(stretch[i] - from) / (to - from) : 0.0;
      of_anchors[i] = BlendAnchors(std::move(before[i]), behind[i], place);
    });
    std::vector<Gap> gaps = GapsOf(stretch);
    // The longest gaps first, so that threads end together.
    std::ranges::stable_sort(
        gaps, std::ranges::greater(), [](const Gap& gap) { return gap.end - gap.begin; });
    pool.ForEach(std::ssize(gaps), [&](int64_t i, int) {
      InferUncertainFrames(gaps[i], stretch, flow, &of_anchors, &colored);
    });
    pool.ForEach(count, [&](int64_t i, int) {
      if (colored[i].color.ab.Empty()) colored[i].color = ColorOf(stretch[i], &of_anchors[i]);
    });
    if (!keys.empty()) last_anchor_ = std::move(keys.back());
    last_ = stretch.back();
    steady_.Add(std::move(colored));
  }

  // Propagates the colours of a frame into those of `way`, which adjoin it, step by step.
  void Propagate(const FilmKey& key,
                 const std::vector<int>& way,
                 const Flow& flow,
                 const std::function<void(int frame, const CarriedColor& color)>& on_frame) const {
    if (way.empty()) return;
    FilmFrames frames = film_.frames;
    frames.flow = flow;
    for (size_t i = 0; i < frames.shot.size(); ++i) frames.shot[i] = -1 - static_cast<int>(i);
    frames.shot[key.frame] = 0;
    for (const int frame : way) frames.shot[frame] = 0;
    ThreadPool one(1);
    CarryAlongFilm(frames,
                   {key},
                   {.correct_after = 1.0},
                   one,
                   context_.cancel(),
                   {[&](int frame, const CarriedColor& color) {
                     if (frame != key.frame) on_frame(frame, color);
                   }});
  }

  std::vector<Gap> GapsOf(const std::vector<int>& stretch) const {
    std::vector<Gap> gaps;
    for (size_t i = 0; i < stretch.size(); ++i) {
      if (shot_.IsAnchor(stretch[i])) continue;
      if (i > 0 && !gaps.empty() && gaps.back().end == i) {
        gaps.back().end = i + 1;
      } else {
        gaps.push_back({i, i + 1});
      }
    }
    return gaps;
  }

  // Infers the frames of a gap that propagation leaves open, the most open one first. Inferred
  // colours are propagated into the other frames.
  void InferUncertainFrames(const Gap& gap,
                            const std::vector<int>& stretch,
                            const Flow& flow,
                            std::vector<CarriedColor>* of_anchors,
                            std::vector<SteadyFrames::Frame>* colored) const {
    const std::vector<int> frames(stretch.begin() + static_cast<std::ptrdiff_t>(gap.begin),
                                  stretch.begin() + static_cast<std::ptrdiff_t>(gap.end));
    std::vector<Image> carried;  // confidences
    std::vector<double> open(frames.size());
    const auto measure = [&](size_t i) {
      open[i] = UncertainShare(carried[i], (*of_anchors)[gap.begin + i]);
    };
    for (size_t i = 0; i < frames.size(); ++i) {
      carried.push_back(std::move(PropagatedColor(frames[i]).confidence));
      measure(i);
    }
    for (size_t left = frames.size(); left > 0; --left) {
      const auto most = std::ranges::max_element(open) - open.begin();
      if (open[most] <= kWorthInferring) return;
      open[most] = 0.0;
      SteadyFrames::Frame& asked = (*colored)[gap.begin + most];
      asked.color = ColorOf(asked.frame, &(*of_anchors)[gap.begin + most]);
      Propagate(AnchorAsKey(asked.frame, asked.color),
                frames,
                flow,
                [&](int frame, const CarriedColor& color) {
                  const auto i = std::ranges::find(frames, frame) - frames.begin();
                  if (open[i] == 0.0) return;
                  FillFromNeighbor(color, &(*of_anchors)[gap.begin + i]);
                  measure(i);
                });
    }
  }

  CarriedColor PropagatedColor(int frame) const {
    const int view = film_.view_of_frame[frame];
    const Camera camera = film_.images.WorkingCamera(view);
    return ReadCarried(context_, film_.scene.views[view], camera.width, camera.height);
  }

  // `of_anchors`: null for anchors. Nothing is guessed between two anchors without guessed colours.
  FusedColor ColorOf(int frame, const CarriedColor* of_anchors) const {
    context_.ThrowIfCancelled();
    const int view = film_.view_of_frame[frame];
    const auto luminance = film_.frames.luminance(frame);
    const CarriedColor carried = PropagatedColor(frame);
    ColorSources sources = coloring_.sources(view);
    if (of_anchors != nullptr) {
      if (!guessed_.contains(shot_.AnchorUpTo(frame)) &&
          !guessed_.contains(shot_.AnchorBehind(frame))) {
        sources.guess = [](const Image&) { return Image(); };
      }
      return ColorBetweenAnchors(*luminance, carried, *of_anchors, sources, context_.cancel());
    }
    ThreadPool one(1);
    return FuseViewColor(*luminance, carried, sources, one, context_.cancel());
  }

  const ShotToColor& shot_;
  const FilmToColor& film_;
  const FrameColoring& coloring_;
  StageContext& context_;
  std::set<int> guessed_;               // anchors with guessed colours
  int last_ = -1;                       // frame of the last stretch
  std::optional<FilmKey> last_anchor_;  // of the last stretch
  SteadyFrames steady_;
};

}  // namespace

void ColorFrames(const Scene& scene,
                 const ViewImages& images,
                 const FrameColoring& coloring,
                 StageContext& context) {
  FilmToColor film{scene, images, scene.ViewsInOrderOfTime()};
  const std::vector<int>& order = film.view_of_frame;
  film.frames = FramesOfViews(scene, order, images);
  std::map<int, ShotToColor> shots;
  for (size_t i = 0; i < order.size(); ++i) {
    shots[film.frames.shot[i]].frames.push_back(static_cast<int>(i));
  }
  for (const int anchor : AnchorFrames(film.frames, {}, context.pool(), context.cancel())) {
    shots[film.frames.shot[anchor]].anchors.push_back(anchor);
  }
  std::vector<int> key_frames;
  for (const int view : coloring.key_views) {
    key_frames.push_back(static_cast<int>(std::ranges::find(order, view) - order.begin()));
  }
  film.near = NearestKeyFrames(film.frames, key_frames);
  for (const auto& [number, shot] : shots) ShotColorer(shot, film, coloring, context).Run();
}

}  // namespace color3d
