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
constexpr float kKnown = 0.1f;                        // confidence of what open places continue
constexpr float kFollowed = 0.3f;                     // ... below which motion does not tell
constexpr double kMostOpen = 0.25;                    // share of a frame that motion may leave open
constexpr float kStranger = 3.0f;  // feature distance that stands for confidence 0

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

bool IsFollowed(const CarriedColor& from_anchor, const CarriedColor& carried) {
  size_t open = 0;
  for (size_t i = 0; i < carried.confidence.data.size(); ++i) {
    open +=
        std::max(from_anchor.confidence.data[i], carried.confidence.data[i]) < kFollowed ? 1 : 0;
  }
  return static_cast<double>(open) <=
         kMostOpen * static_cast<double>(carried.confidence.PlaneSize());
}

// What the anchor tells of a frame stands for what the colorizer would.
FusedColor ColorBetween(const Image& luminance,
                        const CarriedColor& carried,
                        CarriedColor from_anchor,
                        const RelativeChroma& relative_chroma,
                        const CancellationToken& cancel) {
  Image known = from_anchor.confidence;
  for (float& value : known.data) value = value > kKnown ? 1.0f : 0.0f;
  FillHoles(known, &from_anchor.ab);
  InferredColor inferred{Image(luminance.width, luminance.height, 2), from_anchor.confidence};
  const size_t both = inferred.ab.data.size();
  std::copy_n(from_anchor.ab.data.begin(), both, inferred.ab.data.begin());
  for (float& value : inferred.distance.data) value = kStranger * (1.0f - value);
  const ColorSources sources{[&](const Image&, const Image&) { return std::move(inferred); },
                             [](const Image& l) { return Image(l.width, l.height, 2); },
                             relative_chroma};
  ThreadPool one(1);
  FusedColor fused = ColorOfView(luminance, carried, sources, one, cancel);
  for (size_t i = 0; i < fused.provenance.PlaneSize(); ++i) {
    float& guessed = fused.provenance.Plane(0)[i];
    float& by_anchor = fused.provenance.Plane(2)[i];
    guessed = by_anchor * std::clamp(from_anchor.ab.Plane(2)[i], 0.0f, 1.0f);
    by_anchor -= guessed;
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
  // Each frame's nearest anchor, as CarryAlongFilm will see it.
  std::vector<int> OwnersOf(const std::vector<int>& anchors) const {
    std::vector<int> owner(frames_.shot.size(), -1);
    for (size_t i = 0; i < owner.size(); ++i) {
      const int frame = static_cast<int>(i);
      for (const int anchor : anchors) {
        if (frames_.shot[anchor] != frames_.shot[i]) continue;
        if (owner[i] < 0 || std::abs(anchor - frame) < std::abs(owner[i] - frame)) {
          owner[i] = anchor;
        }
      }
    }
    return owner;
  }

  std::vector<Section> SectionsOf(const std::vector<int>& anchors) const {
    const std::vector<int> owner = OwnersOf(anchors);
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
      const FusedColor color = coloring_.alone(order_[frame]);
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
      coloring_.deliver(order_[frame], ColorOfFrame(order_[frame], std::move(from_anchor)));
    });
  }

  FusedColor ColorOfFrame(int view, CarriedColor from_anchor) const {
    context_.cancel().ThrowIfCancelled();
    const auto luminance = images_.Luminance(view);
    const CarriedColor carried =
        ReadCarried(context_, scene_.views[view], luminance->width, luminance->height);
    if (!IsFollowed(from_anchor, carried)) return coloring_.alone(view);
    return ColorBetween(
        *luminance, carried, std::move(from_anchor), coloring_.relative_chroma, context_.cancel());
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
