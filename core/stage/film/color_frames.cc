#include "core/stage/film/color_frames.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/film/anchor_frames.h"
#include "core/film/film_carry.h"
#include "core/image/fill_holes.h"
#include "core/stage/formats/artifacts.h"

namespace color3d {
namespace {

constexpr int64_t kSectionBytes = int64_t{64} << 20;  // of colours that wait for each other
constexpr int kColorChannels = 3;                     // a, b and the share that is guessed
constexpr float kFollowed = 0.5f;                     // confidence from which motion tells
constexpr double kWorthAsking = 0.02;                 // share of a frame that is open

// An anchor's delivered colours, of which all are sure.
CarriedColor AsKey(const FusedColor& fused) {
  Image color(fused.ab.width, fused.ab.height, kColorChannels);
  std::copy(fused.ab.data.begin(), fused.ab.data.end(), color.data.begin());
  for (size_t i = 0; i < color.PlaneSize(); ++i) {
    const float guessed = fused.provenance.Plane(0)[i], inferred = fused.provenance.Plane(2)[i];
    color.Plane(2)[i] = guessed / std::max(guessed + inferred, 1e-6f);
  }
  return {std::move(color), Image(fused.ab.width, fused.ab.height, 1, 1.0f)};
}

// 1 where the frame's own sources need not be asked.
Image KnownOf(const CarriedColor& from_anchor, const Image& carried_surely) {
  Image known = carried_surely;
  for (size_t i = 0; i < known.data.size(); ++i) {
    if (from_anchor.confidence.data[i] > kFollowed) known.data[i] = 1.0f;
  }
  return known;
}

double ShareOpen(const Image& known) {
  const auto open = std::count(known.data.begin(), known.data.end(), 0.0f);
  return static_cast<double>(open) / static_cast<double>(known.data.size());
}

// What the anchor tells of a frame stands for what its sources would.
InferredColor AnswerOf(const CarriedColor& from_anchor,
                       const Image& known,
                       const Image& luminance,
                       const ColorSources& sources) {
  InferredColor answer;
  if (ShareOpen(known) > kWorthAsking) {
    answer = sources.infer(luminance, known);
  } else {
    answer = {Image(luminance.width, luminance.height, 2),
              Image(luminance.width, luminance.height, 1)};
    Image followed = from_anchor.confidence;
    for (float& value : followed.data) value = value > kFollowed ? 1.0f : 0.0f;
    std::copy_n(from_anchor.ab.data.begin(), answer.ab.data.size(), answer.ab.data.begin());
    FillHoles(followed, &answer.ab);
  }
  for (size_t i = 0; i < luminance.PlaneSize(); ++i) {
    if (from_anchor.confidence.data[i] <= kFollowed) continue;
    for (int c = 0; c < 2; ++c) answer.ab.Plane(c)[i] = from_anchor.ab.Plane(c)[i];
    if (!answer.distance.Empty()) answer.distance.data[i] = 0.0f;
  }
  return answer;
}

FusedColor ColorBetween(const Image& luminance,
                        const CarriedColor& carried,
                        const CarriedColor& from_anchor,
                        const ColorSources& sources,
                        const CancellationToken& cancel) {
  ColorSources with_anchor = sources;
  with_anchor.infer = [&](const Image& l, const Image& carried_surely) {
    return AnswerOf(from_anchor, KnownOf(from_anchor, carried_surely), l, sources);
  };
  ThreadPool one(1);
  FusedColor fused = ColorOfView(luminance, carried, with_anchor, one, cancel);
  // What the anchor was given as a guess is one here, too.
  for (size_t i = 0; i < fused.provenance.PlaneSize(); ++i) {
    if (from_anchor.confidence.data[i] <= kFollowed) continue;
    float& inferred = fused.provenance.Plane(2)[i];
    const float guessed = inferred * std::clamp(from_anchor.ab.Plane(2)[i], 0.0f, 1.0f);
    fused.provenance.Plane(0)[i] += guessed;
    inferred -= guessed;
  }
  return fused;
}

// Some anchors, and the frames that belong to them.
struct Section {
  std::vector<int> anchors;
  FilmFrames frames;
};

class FramesColorer {
 public:
  FramesColorer(const Scene& scene,
                const ViewImages& images,
                const FrameColoring& coloring,
                StageContext& context)
      : scene_(scene),
        images_(images),
        coloring_(coloring),
        context_(context),
        order_(scene.ViewsInOrderOfTime()) {
    for (const int view : order_) frames_.shot.push_back(scene.views[view].moment->shot);
    frames_.luminance = [this](int frame) { return images_.Luminance(order_[frame]); };
  }

  void Run() {
    const std::vector<int> anchors = AnchorFrames(frames_, {}, context_.pool(), context_.cancel());
    for (const Section& section : SectionsOf(anchors)) Color(section);
  }

 private:
  std::vector<Section> SectionsOf(const std::vector<int>& anchors) const {
    const std::vector<int> owner = NearestKeyFrames(frames_.shot, anchors);
    const Camera camera = images_.WorkingCamera(0);
    const int64_t bytes = int64_t{camera.width} * camera.height * (kColorChannels + 1) * 4;
    const auto at_once = std::max<int64_t>(
        kSectionBytes / bytes, 2 * static_cast<int64_t>(context_.pool().thread_count()));
    std::vector<Section> sections;
    int64_t waiting = 0;
    for (const int anchor : anchors) {
      const auto owned = std::count(owner.begin(), owner.end(), anchor);
      if (sections.empty() || waiting + owned > at_once) {
        sections.emplace_back();
        waiting = 0;
      }
      sections.back().anchors.push_back(anchor);
      waiting += owned;
    }
    for (Section& section : sections) {
      section.frames = frames_;
      for (size_t i = 0; i < owner.size(); ++i) {
        if (std::find(section.anchors.begin(), section.anchors.end(), owner[i]) ==
            section.anchors.end()) {
          section.frames.shot[i] = -1 - static_cast<int>(i);  // nobody colours it
        }
      }
    }
    return sections;
  }

  void Color(const Section& section) {
    std::vector<FilmKey> keys(section.anchors.size());
    context_.pool().ForEach(static_cast<int64_t>(keys.size()), [&](int64_t i, int) {
      const int frame = section.anchors[i];
      const FusedColor color = ColorOf(order_[frame], nullptr);
      coloring_.deliver(order_[frame], color);
      keys[i] = {frame, AsKey(color)};
    });
    std::vector<std::pair<int, CarriedColor>> between;
    CarryAlongFilm(section.frames,
                   keys,
                   {.find_again = false},
                   context_.pool(),
                   context_.cancel(),
                   [&](int frame, const CarriedColor& color) {
                     const auto& anchors = section.anchors;
                     if (std::find(anchors.begin(), anchors.end(), frame) == anchors.end()) {
                       between.emplace_back(frame, color);
                     }
                   });
    keys.clear();
    context_.pool().ForEach(static_cast<int64_t>(between.size()), [&](int64_t i, int) {
      auto& [frame, from_anchor] = between[i];
      coloring_.deliver(order_[frame], ColorOf(order_[frame], &from_anchor));
    });
  }

  // `from_anchor`: null of an anchor.
  FusedColor ColorOf(int view, const CarriedColor* from_anchor) const {
    context_.cancel().ThrowIfCancelled();
    const auto luminance = images_.Luminance(view);
    const CarriedColor carried =
        ReadCarried(context_, scene_.views[view], luminance->width, luminance->height);
    const ColorSources sources = coloring_.sources(view);
    if (from_anchor != nullptr) {
      return ColorBetween(*luminance, carried, *from_anchor, sources, context_.cancel());
    }
    ThreadPool one(1);
    return ColorOfView(*luminance, carried, sources, one, context_.cancel());
  }

  const Scene& scene_;
  const ViewImages& images_;
  const FrameColoring& coloring_;
  StageContext& context_;
  const std::vector<int> order_;
  FilmFrames frames_;
};

}  // namespace

void ColorFrames(const Scene& scene,
                 const ViewImages& images,
                 const FrameColoring& coloring,
                 StageContext& context) {
  FramesColorer(scene, images, coloring, context).Run();
}

}  // namespace color3d
