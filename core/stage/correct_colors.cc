#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/digest.h"
#include "core/base/file_cache.h"
#include "core/base/mutex.h"
#include "core/base/range_check.h"
#include "core/carry/confidence.h"
#include "core/color/lab.h"
#include "core/colorizer/corrector.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/image/codec.h"
#include "core/scene/key_photo.h"
#include "core/scene/photo_masks.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/recolor/recolor_ranges.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/given_colors.h"
#include "core/stage/sources/view_positions.h"

namespace color3d {
namespace {

constexpr size_t kMaxCorrections = 64;
constexpr int kMaxProposals = 16;
constexpr size_t kPlacesOfAllViews = 3000;  // candidates of proposals
constexpr int kPullPx = 480;                // longer side of the pictures of the pull
constexpr double kHardlyKnown = 0.2;        // least share of a stroke that lies on the geometry
constexpr int64_t kCacheBytes = int64_t{256} << 20;
// Version of the cache. Increase when the features of a colorizer change.
constexpr char kCellsRecipe[] = "cells of corrections 1\n";

// Marks masked pixels as seen, so that no stroke is proposed for them.
void MarkMaskedAsSeen(const Image& mask, PlacedPicture* picture) {
  if (picture->seen.Empty()) picture->seen = Image(mask.width, mask.height, 1);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (mask.data[i] == 0.0f) picture->seen.data[i] = 1.0f;
  }
}

// The scene's pictures in their colours without corrections.
class ColoredViews {
 public:
  explicit ColoredViews(StageContext& context)
      : context_(context),
        scene_(ReadScene(context)),
        key_(ReadKeyView(context, scene_)),
        images_(scene_,
                context.scene_folder(),
                ColoredSide(context, scene_.views[key_]),
                /*cache_budget_bytes=*/0),
        positions_(scene_, context) {}

  const Scene& scene() const { return scene_; }
  const ViewImages& images() const { return images_; }

  struct Masked {
    PlacedPicture picture;              // without its position
    std::shared_ptr<const Image> mask;  // null: none
  };
  Masked Picture(int view) const {
    PlacedPicture picture{*images_.Luminance(view), {}, {}, {}};
    picture.ab = ReadTargetAb(context_,
                              scene_.views[view],
                              view == key_,
                              picture.luminance.width,
                              picture.luminance.height);
    const auto mask = images_.Mask(view);
    const Image provenance = Provenance(view, picture.luminance);
    if (!provenance.Empty()) {
      picture.seen = Image(provenance.width, provenance.height, 1);
      std::copy_n(provenance.Plane(1), picture.seen.data.size(), picture.seen.data.begin());
    }
    if (mask) MarkMaskedAsSeen(*mask, &picture);
    return {std::move(picture), mask};
  }
  Image Position(int view, const Masked& of) const {
    return positions_.Of(view, images_.WorkingCamera(view), of.picture.luminance, of.mask.get());
  }
  Image Provenance(int view, const Image& size) const {
    return ReadProvenance(context_, scene_.views[view], size.width, size.height);
  }

 private:
  StageContext& context_;
  const Scene scene_;
  const int key_;
  const ViewImages images_;
  const ViewPositions positions_;
};

// Cells of the views for the corrector, kept between jobs: a user tries several strokes.
class KeptCells {
 public:
  KeptCells(const ColoredViews& views, const StageContext& context)
      : views_(views), cache_(context.cache_folder(), kCacheBytes) {
    for (const char* input : {artifact::kColorizer, artifact::kScene, artifact::kGeometry}) {
      if (context.HasInput(input)) inputs_ += DigestFile(context.Input(input)).sha256;
    }
  }
  ~KeptCells() { cache_.Trim(); }
  KeptCells(const KeptCells&) = delete;
  KeptCells& operator=(const KeptCells&) = delete;

  PictureCells Of(int view, const ColoredViews::Masked& of, const Corrector& corrector) const {
    const std::string key = Key(view, of);
    if (const auto bytes = cache_.Get(key)) {
      if (auto cells = ParsePictureCells(*bytes)) return *std::move(cells);
    }
    PictureCells cells = corrector.Describe(of.picture.luminance, views_.Position(view, of));
    cache_.Put(key, SerializePictureCells(cells));
    return cells;
  }

 private:
  std::string Key(int view, const ColoredViews::Masked& of) const {
    Sha256 key;
    key.Update(kCellsRecipe);
    key.Update(inputs_);
    key.Update(views_.scene().views[view].name);
    UpdateDigest(of.picture.luminance, &key);
    if (of.mask) UpdateDigest(*of.mask, &key);
    return key.FinishHex();
  }
  static void UpdateDigest(const Image& image, Sha256* digest) {
    digest->Update(fmt::format("{}x{}", image.width, image.height));
    digest->Update({reinterpret_cast<const char*>(image.data.data()),
                    image.data.size() * sizeof(image.data.front())});
  }

  const ColoredViews& views_;
  const FileCache cache_;
  std::string inputs_;
};

// A correction at the size of the working pictures.
struct Painted {
  int view;
  Correction correction;
};

double Mean(const Image& picture) {
  double sum = 0.0;
  for (const float value : picture.data) sum += value;
  return sum / static_cast<double>(std::max<size_t>(picture.data.size(), 1));
}

void WarnIfOffGeometry(const Painted& painted, const std::string& name, StageContext& context) {
  const Image& position = painted.correction.picture.position;
  double known = 0.0, all = 0.0;
  for (size_t i = 0; i < painted.correction.painted.data.size(); ++i) {
    const double weight = painted.correction.painted.data[i];
    all += weight;
    if (!position.Empty()) known += weight * position.Plane(3)[i];
  }
  if (known >= kHardlyKnown * all) return;
  context.Warn("the correction of " + name +
               " lies where the 3D scene does not show the photo, e.g. on sky; it "
               "reaches other views by similarity alone");
}

Painted ReadCorrection(const ColorCorrection& wanted,
                       const ColoredViews& views,
                       StageContext& context) {
  const int index = views.scene().FindView(wanted.view);
  const View& view = views.scene().views[index];
  if (view.held_out) {
    throw InvalidArgument("it is held out for evaluation; correct another view");
  }
  ColoredViews::Masked masked = views.Picture(index);
  masked.picture.position = views.Position(index, masked);
  Painted painted{index, {std::move(masked.picture), {}, {}, 1.0}};
  Correction& correction = painted.correction;
  const GivenColors given =
      ReadGivenColors(wanted.colors,
                      ReadKeyPhoto(context.scene_folder() / view.image_file, context.MemoryBytes()),
                      correction.picture.ab,
                      context);
  CarriedColor undistorted = UndistortGivenColors(given.ab, given.given, index, views.images());
  correction.ab = std::move(undistorted.ab);
  correction.painted = std::move(undistorted.confidence);
  correction.reach = given.reach;
  if (masked.mask) {
    ClearMasked(masked.mask.get(), &correction.painted);
    if (Mean(correction.painted) == 0.0) {
      throw InvalidArgument("all that it paints is masked out; paint other pixels");
    }
  }
  WarnIfOffGeometry(painted, view.name, context);
  return painted;
}

std::vector<Painted> ReadCorrections(const std::vector<ColorCorrection>& wanted,
                                     const ColoredViews& views,
                                     StageContext& context) {
  std::vector<Painted> painted;
  for (size_t i = 0; i < wanted.size(); ++i) {
    context.ThrowIfCancelled();
    try {
      painted.push_back(ReadCorrection(wanted[i], views, context));
    } catch (const Error& e) {
      throw Error(e.code(),
                  "correction {} of {}, of the view {}: {}",
                  i + 1,
                  wanted.size(),
                  wanted[i].view,
                  e.what());
    }
  }
  return painted;
}

// Counts corrected pixels as seen.
void CountAsSeen(const Image& share, Image* provenance) {
  for (size_t i = 0; i < share.data.size(); ++i) {
    for (int c = 0; c < kProvenancePlanes; ++c) provenance->Plane(c)[i] *= 1.0f - share.data[i];
    provenance->Plane(kSeenPlane)[i] += share.data[i];
  }
}

// A view with the corrections applied.
struct CorrectedView {
  CorrectedColor answer;
  Image ab;  // 2 channels, Lab units
};

CorrectedView CorrectView(int number,
                          const ColoredViews::Masked& masked,
                          const std::vector<Painted>& painted,
                          const Corrector& corrector,
                          const KeptCells& cells,
                          int samples) {
  const PlacedPicture& picture = masked.picture;
  CorrectedView corrected{corrector.Predict(picture, cells.Of(number, masked, corrector), samples),
                          picture.ab};
  auto& [answer, ab] = corrected;
  for (size_t i = 0; i < ab.data.size(); ++i) ab.data[i] += answer.change.data[i];
  for (const Painted& one : painted) {
    if (one.view != number) continue;
    MixIn(one.correction.ab, one.correction.painted, &ab);
    for (size_t i = 0; i < answer.share.data.size(); ++i) {
      float& share = answer.share.data[i];
      share = std::max(share, one.correction.painted.data[i]);
      if (&one == &painted.back()) {
        float& pull = answer.pull.data[i];
        pull = std::max(pull, one.correction.painted.data[i]);
      }
    }
  }
  return corrected;
}

// Writes the views of the proposed places in their `colors` for the user to paint on, and returns
// the places as JSON.
nlohmann::ordered_json WriteProposals(const std::vector<ProposedPlace>& proposed,
                                      const std::vector<int>& view_of_sample,
                                      const std::function<Image(int view)>& colors,
                                      const ColoredViews& views,
                                      StageContext& context) {
  auto places = nlohmann::ordered_json::array();
  std::set<int> painted;
  for (const ProposedPlace& place : proposed) {
    const int index = view_of_sample[place.picture];
    const View& view = views.scene().views[index];
    const Image photo = ReadImage(context.scene_folder() / view.image_file);
    places.push_back({{"view", view.name},
                      {"x", static_cast<int>(place.x * photo.width)},
                      {"y", static_cast<int>(place.y * photo.height)},
                      {"gain", place.gain}});
    if (!painted.insert(index).second) continue;
    context.WriteOutput(ViewArtifact(artifact::kPaint, view),
                        EncodePng8(PaintablePhoto(photo, colors(index))));
  }
  return places;
}

}  // namespace

void CorrectColorsOptions::Validate() const {
  const size_t count = corrections.size() + ranges.size();
  if (count > kMaxCorrections) {
    throw InvalidArgument(
        "{} corrections were given; at most {} are taken", count, kMaxCorrections);
  }
  if (!corrections.empty() && !ranges.empty()) {
    throw InvalidArgument(
        "the correction of {} has no range of time, as a film's must (begin_s, end_s); to colour "
        "the film anew from it, make it an additional key view",
        corrections.front().view);
  }
  RangeCheck("correction option")("proposals", proposals, 0, kMaxProposals);
}

void RunCorrectColors(const CorrectColorsOptions& options,
                      StageContext& context,
                      const std::string& encoder) {
  options.Validate();
  if (!options.ranges.empty()) {
    return RecolorRanges(options.ranges, ReadScene(context), encoder, context);
  }
  const ColoredViews views(context);
  const Scene& scene = views.scene();
  const std::vector<Painted> painted = ReadCorrections(options.corrections, views, context);
  std::vector<Correction> corrections;
  for (const Painted& one : painted) corrections.push_back(one.correction);
  // Views are corrected in parallel, each on one thread.
  const auto colorizer = LoadColorizer(context.ReadInput(artifact::kColorizer),
                                       context.LoadEncoder(encoder),
                                       /*threads=*/1);
  const auto corrector = colorizer->Correct(corrections);
  const KeptCells cells(views, context);
  const auto total = std::ssize(scene.views);
  const int samples = options.proposals == 0
                          ? 0
                          : static_cast<int>(kPlacesOfAllViews / scene.TrainingViews().size() + 1);
  std::vector<PlaceSample> samples_of(total);
  Mutex outputs;
  int64_t done = 0;
  double changed = 0.0;
  context.pool().ForEach(total, [&](int64_t index, int) {
    context.ThrowIfCancelled();
    const auto number = static_cast<int>(index);
    const View& view = scene.views[index];
    const ColoredViews::Masked masked = views.Picture(number);
    auto [answer, ab] =
        CorrectView(number, masked, painted, *corrector, cells, view.held_out ? 0 : samples);
    Image provenance = views.Provenance(number, masked.picture.luminance);
    if (!provenance.Empty()) CountAsSeen(answer.share, &provenance);
    const std::string ab_png = EncodeAbPng(ab);
    const std::string pull_png = painted.empty() ? "" : EncodePng8(FitWithin(answer.pull, kPullPx));
    const std::string provenance_png = provenance.Empty() ? "" : EncodePng8(provenance);
    const MutexLock lock(outputs);
    changed += Mean(answer.share);
    if (!painted.empty()) {
      context.WriteOutput(ViewArtifact(artifact::kCorrectedAb, view), ab_png);
      context.WriteOutput(ViewArtifact(artifact::kPull, view), pull_png);
      if (!provenance.Empty()) {
        context.WriteOutput(ViewArtifact(artifact::kCorrectedProvenance, view), provenance_png);
      }
    }
    samples_of[index] = std::move(answer.sample);
    context.ReportProgress(++done, total, "correcting " + view.name);
  });
  const std::vector<int> training = scene.TrainingViews();
  std::vector<PlaceSample> places;
  for (const int view : training) places.push_back(std::move(samples_of[view]));
  // The colours of the few proposed views are computed again, which bounds memory.
  const auto colors = [&](int view) {
    return CorrectView(view, views.Picture(view), painted, *corrector, cells, 0).ab;
  };
  nlohmann::ordered_json facts;
  facts["corrections"] = painted.size();
  facts["share_changed"] = changed / static_cast<double>(total);
  facts["proposals"] = WriteProposals(
      corrector->Propose(places, options.proposals), training, colors, views, context);
  context.WriteOutput(artifact::kCorrections, facts.dump(2));
}

}  // namespace color3d
