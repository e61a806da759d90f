#include "core/stage/recolor/recolor_ranges.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/mutex.h"
#include "core/carry/confidence.h"
#include "core/colorizer/corrector.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/film/film_carry.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/film/between_anchors.h"
#include "core/stage/film/frames_of_views.h"
#include "core/stage/film/steady_frames.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/recolor/time_ranges.h"
#include "core/stage/sources/given_colors.h"

namespace color3d {
namespace {

constexpr int kAtOnce = 16;  // frames; bounds memory
// Neighbouring frames are read several times.
constexpr int64_t kRecoloredFramesCacheBytes = int64_t{32} << 20;

// The coloured film, and the colorizer that coloured it.
struct FilmToRecolor {
  const Scene& scene;
  const ViewImages& images;
  const Colorizer& colorizer;
  int key;  // the chosen key view
  StageContext& context;

  // The frame in its present colours.
  PlacedPicture Picture(int view) const {
    PlacedPicture picture{*images.Luminance(view), {}, {}, {}};
    const Image& size = picture.luminance;
    picture.ab = ReadTargetAb(context, scene.views[view], view == key, size.width, size.height);
    return picture;
  }
};

// Channels to propagate from a key view: a, b and the painted share. Unpainted parts have their
// present colours. Confidence is 1 everywhere.
CarriedColor PaintOver(Image ab, const CarriedColor& color) {
  MixIn(color.ab, color.confidence, &ab);
  CarriedColor key{Image(ab.width, ab.height, 3), Image(ab.width, ab.height, 1, 1.0f)};
  std::ranges::copy(ab.data, key.ab.data.begin());
  std::copy_n(color.confidence.data.begin(), ab.PlaneSize(), key.ab.Plane(2));
  return key;
}

// A frame of a range before fusion.
struct FrameToRecolor {
  Image before;          // its present colours
  Image changed;         // these, changed as the corrector infers
  Image change_share;    // confidence of that change; may be empty
  Image provenance;      // of the present colours; may be empty
  CarriedColor painted;  // propagated from key views: see PaintOver
};

// Known colours of a frame: painted or left colours where they are propagated surely, elsewhere
// seen colours of other key views, as changed. `is_old`: 1 where they are not of the range's key
// views.
CarriedColor KnownColors(const FrameToRecolor& frame, Image* is_old) {
  const int width = frame.before.width, height = frame.before.height;
  CarriedColor known{Image(width, height, 2), Image(width, height, 1)};
  *is_old = Image(width, height, 1);
  for (size_t i = 0; i < known.ab.PlaneSize(); ++i) {
    const float followed = frame.painted.confidence.data[i];
    const float painted = followed * std::clamp(frame.painted.ab.Plane(2)[i], 0.0f, 1.0f);
    const float left = followed - painted;
    const float seen = frame.provenance.Empty() ? 0.0f : frame.provenance.Plane(kSeenPlane)[i];
    const Image* from = &frame.painted.ab;
    known.confidence.data[i] = painted;
    if (left > kDecisiveConfidence) {
      from = &frame.before;
      known.confidence.data[i] = left;
    } else if (painted <= kDecisiveConfidence && seen > kDecisiveConfidence) {
      from = &frame.changed;
      known.confidence.data[i] = seen;
    }
    is_old->data[i] = from == &frame.painted.ab ? 0.0f : 1.0f;
    for (int c = 0; c < 2; ++c) known.ab.Plane(c)[i] = from->Plane(c)[i];
  }
  return known;
}

// Pixels without colours of the range's key views keep their provenance, but for inferred changes.
void SetProvenance(const FrameToRecolor& frame, const Image& is_old, Image* provenance) {
  for (size_t i = 0; i < provenance->PlaneSize(); ++i) {
    const float seen = is_old.data[i] > 0.0f ? 0.0f : provenance->Plane(kSeenPlane)[i];
    const float change = frame.change_share.Empty() ? 0.0f : frame.change_share.data[i];
    for (int c = 0; c < kProvenancePlanes; ++c) {
      const float was = frame.provenance.Empty() ? (c == kInferredPlane ? 1.0f : 0.0f)
                                                 : frame.provenance.Plane(c)[i];
      const float is = c == kInferredPlane ? was + change * (1.0f - was) : was * (1.0f - change);
      provenance->Plane(c)[i] = (c == kSeenPlane ? seen : 0.0f) + (1.0f - seen) * is;
    }
  }
}

// Recolours one range.
class RangeColorer {
 public:
  RangeColorer(const RecoloredRange& range, const FilmToRecolor& film, std::filesystem::path folder)
      : range_(range), film_(film), folder_(std::move(folder)) {
    std::filesystem::create_directories(folder_);
  }

  // Calls `deliver` once for each frame of the range, from several threads.
  void Run(const std::function<void(int view, const FusedColor& color)>& deliver) {
    ReadKeys();
    SteadyFrames steady(Carry());
    const auto count = static_cast<int>(range_.views.size());
    for (int begin = 0; begin < count; begin += kAtOnce) {
      const int end = std::min(count, begin + kAtOnce);
      steady.Add(Color(begin, end));
      steady.Deliver(end == count, film_.context, [&](int frame, const FusedColor& color) {
        deliver(range_.views[frame], color);
      });
    }
  }

 private:
  void ReadKeys() {
    std::vector<Correction> corrections;
    for (const RecoloredRange::Key& key : range_.keys) {
      CarriedColor color =
          ReadAdditionalKeyColor(film_.context, film_.scene, key.view, film_.images);
      const std::vector<float>& painted = color.confidence.data;
      if (std::ranges::none_of(painted, [](float p) { return p > 0.0f; })) {
        throw InvalidArgument(
            "the key view {} has no painted pixels to recolour its range with; paint on it",
            film_.scene.views[key.view].name);
      }
      PlacedPicture picture = film_.Picture(key.view);
      const auto frame = std::ranges::find(range_.views, key.view);
      keys_.push_back(
          {static_cast<int>(frame - range_.views.begin()), PaintOver(picture.ab, color)});
      // Unpainted parts are right as they are, and correct nothing.
      Image wanted = picture.ab;
      MixIn(color.ab, color.confidence, &wanted);
      Image sure(wanted.width, wanted.height, 1, 1.0f);
      corrections.push_back({std::move(picture), std::move(wanted), std::move(sure)});
    }
    try {
      corrector_ = film_.colorizer.Correct(corrections);
    } catch (const Error& e) {
      // Without feature neighbours there is no similarity to infer from.
      if (e.code() != ErrorCode::kFailedPrecondition) throw;
    }
  }

  // Carries the colours of the key views along the range. Returns the nearest ones of each frame.
  std::vector<NearKeyFrames> Carry() const {
    const FilmFrames frames = FramesOfViews(film_.scene, range_.views, film_.images);
    std::vector<int> key_frames;
    for (const FilmKey& key : keys_) key_frames.push_back(key.frame);
    const auto keep = [&](int frame, const CarriedColor& color) {
      Image ab(color.ab.width, color.ab.height, 2), painted(color.ab.width, color.ab.height, 1);
      std::copy_n(color.ab.data.begin(), ab.data.size(), ab.data.begin());
      std::copy_n(color.ab.Plane(2), painted.data.size(), painted.data.begin());
      WriteFileAtomic(FileOf(frame, "colors"), EncodeAbPng(ab, color.confidence));
      WriteFileAtomic(FileOf(frame, "painted"), EncodePng8(painted));
    };
    CarryAlongFilm(frames,
                   keys_,
                   {},
                   film_.context.pool(),
                   film_.context.cancel(),
                   {keep, [&](int frame, const CarriedColor& second) {
                      CarriedColor color = PropagatedColor(frame);
                      if (FillUncertain(second, &color) > 0) keep(frame, color);
                    }});
    return NearestKeyFrames(frames, key_frames);
  }

  std::filesystem::path FileOf(int frame, const char* what) const {
    return folder_ / fmt::format("{}_{}.png", what, frame);
  }

  CarriedColor PropagatedColor(int frame) const {
    const AbMap map = DecodeAbPng(ReadFile(FileOf(frame, "colors")), "colors");
    const Image painted = DecodeImage(ReadFile(FileOf(frame, "painted")), "painted");
    CarriedColor color{Image(map.ab.width, map.ab.height, 3), map.confidence};
    std::ranges::copy(map.ab.data, color.ab.data.begin());
    std::copy_n(painted.data.begin(), map.ab.PlaneSize(), color.ab.Plane(2));
    return color;
  }

  const FilmKey* KeyAt(int frame) const {
    const auto key = std::ranges::find(keys_, frame, &FilmKey::frame);
    return key == keys_.end() ? nullptr : &*key;
  }

  // Recolours the frames from `begin` to `end`.
  std::vector<SteadyFrames::Frame> Color(int begin, int end) const {
    std::vector<SteadyFrames::Frame> colored(end - begin);
    film_.context.pool().ForEach(end - begin, [&](int64_t i, int) {
      film_.context.ThrowIfCancelled();
      const int frame = begin + static_cast<int>(i);
      colored[i].frame = frame;
      colored[i].color = ColorOf(frame);
      if (frame == 0) return;
      colored[i].flow_from_last = FlowBetween(*film_.images.Luminance(range_.views[frame - 1]),
                                              *film_.images.Luminance(range_.views[frame]));
    });
    return colored;
  }

  FusedColor ColorOf(int frame) const {
    const int view = range_.views[frame];
    const PlacedPicture picture = film_.Picture(view);
    const Image& luminance = picture.luminance;
    FrameToRecolor recolored{
        picture.ab,
        picture.ab,
        {},
        ReadProvenance(film_.context, film_.scene.views[view], luminance.width, luminance.height),
        PropagatedColor(frame)};
    if (corrector_) {
      CorrectedColor corrected = corrector_->Predict(picture, 0);
      for (size_t i = 0; i < recolored.changed.data.size(); ++i) {
        recolored.changed.data[i] += corrected.change.data[i];
      }
      recolored.change_share = std::move(corrected.share);
    }
    Image is_old;
    const CarriedColor known = KnownColors(recolored, &is_old);
    const ColorSources sources{[&](const Image&, const Image&) {
                                 return InferredColor{recolored.changed, {}};
                               },
                               {},
                               film_.colorizer.relative_chroma()};
    ThreadPool one(1);
    FusedColor color = FuseViewColor(luminance, known, sources, one, film_.context.cancel());
    SetProvenance(recolored, is_old, &color.provenance);
    if (const FilmKey* key = KeyAt(frame)) {
      std::copy_n(key->color.ab.data.begin(), color.ab.data.size(), color.ab.data.begin());
    }
    return color;
  }

  const RecoloredRange& range_;
  const FilmToRecolor& film_;
  const std::filesystem::path folder_;
  std::vector<FilmKey> keys_;  // FilmKey::frame: index in range_.views
  std::unique_ptr<const Corrector> corrector_;
};

nlohmann::ordered_json FactsOf(const std::vector<RecoloredRange>& ranges, const Scene& scene) {
  auto recolored = nlohmann::ordered_json::array();
  for (const RecoloredRange& range : ranges) {
    for (const RecoloredRange::Key& key : range.keys) {
      nlohmann::ordered_json one{{"view", scene.views[key.view].name},
                                 {"first", scene.views[range.views.front()].name},
                                 {"last", scene.views[range.views.back()].name}};
      if (key.given->begin_s) one["begin_s"] = *key.given->begin_s;
      if (key.given->end_s) one["end_s"] = *key.given->end_s;
      recolored.push_back(std::move(one));
    }
  }
  return recolored;
}

}  // namespace

void RecolorRanges(const std::vector<RangeKeyView>& keys,
                   const Scene& scene,
                   const std::string& encoder,
                   StageContext& context) {
  const std::vector<RecoloredRange> ranges = RangesOf(keys, scene);
  // Frames are coloured in parallel, each on one thread.
  const auto colorizer = LoadColorizer(
      context.ReadInput(artifact::kColorizer), context.LoadEncoder(encoder), /*threads=*/1);
  const int key = ReadKeyView(context, scene);
  const ViewImages images(scene,
                          context.scene_folder(),
                          ColoredSide(context, scene.views[key]),
                          kRecoloredFramesCacheBytes);
  const FilmToRecolor film{scene, images, *colorizer, key, context};
  int64_t total = 0, done = 0;
  for (const RecoloredRange& range : ranges) total += std::ssize(range.views);
  Mutex outputs;
  for (size_t i = 0; i < ranges.size(); ++i) {
    RangeColorer(ranges[i], film, context.scratch_folder() / fmt::format("range_{}", i))
        .Run([&](int index, const FusedColor& color) {
          const View& view = scene.views[index];
          const std::string ab = EncodeAbPng(color.ab);
          const std::string provenance = EncodePng8(color.provenance);
          const MutexLock lock(outputs);
          context.WriteOutput(ViewArtifact(artifact::kCorrectedAb, view), ab);
          context.WriteOutput(ViewArtifact(artifact::kCorrectedProvenance, view), provenance);
          context.ReportProgress(++done, total, "recolouring " + view.name);
        });
  }
  nlohmann::ordered_json facts;
  facts["corrections"] = keys.size();
  facts["share_changed"] = static_cast<double>(total) / static_cast<double>(scene.views.size());
  facts["proposals"] = nlohmann::ordered_json::array();
  facts["recolored"] = FactsOf(ranges, scene);
  context.WriteOutput(artifact::kCorrections, facts.dump(2));
}

}  // namespace color3d
