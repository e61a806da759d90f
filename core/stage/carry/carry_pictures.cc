#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/carry/confidence.h"
#include "core/film/film_carry.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/carry/automatic_colors.h"
#include "core/stage/carry/carry_by_kind.h"
#include "core/stage/carry/carry_results.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_checkpoint.h"
#include "core/stage/formats/key_views.h"

namespace color3d {
namespace {

// Shares of a picture that are reached: less is taken for a chance; with more its colours are
// carried on.
constexpr double kMinReached = 0.05;
constexpr double kReached = 0.4;
constexpr int kRounds = 3;         // from picture to picture
constexpr size_t kMaxSources = 8;  // of a round but the first, those that are reached best

// Pictures of any shape in the middle of a square of equal size, so that they compare like frames.
class Canvas {
 public:
  explicit Canvas(int side) : side_(side) {}

  Image Put(const Image& picture, float outside) const {
    Image canvas(side_, side_, picture.channels, outside);
    const auto [left, top] = Place(picture.width, picture.height);
    for (int c = 0; c < picture.channels; ++c) {
      for (int y = 0; y < picture.height; ++y) {
        const float* row = picture.Plane(c) + static_cast<size_t>(y) * picture.width;
        std::copy_n(
            row, picture.width, canvas.Plane(c) + static_cast<size_t>(y + top) * side_ + left);
      }
    }
    return canvas;
  }
  Image Take(const Image& canvas, int width, int height) const {
    Image picture(width, height, canvas.channels);
    const auto [left, top] = Place(width, height);
    for (int c = 0; c < canvas.channels; ++c) {
      for (int y = 0; y < height; ++y) {
        const float* row = canvas.Plane(c) + static_cast<size_t>(y + top) * side_ + left;
        std::copy_n(row, width, picture.Plane(c) + static_cast<size_t>(y) * width);
      }
    }
    return picture;
  }

 private:
  std::pair<int, int> Place(int width, int height) const {
    return {(side_ - width) / 2, (side_ - height) / 2};
  }
  int side_;
};

// A coloured picture from which others take colours.
struct Source {
  int view = 0;
  FilmKey key;  // on the canvas
  std::shared_ptr<const Image> luminance;
  std::unique_ptr<ReappearingRegions> regions;
};

// Compressed, so that memory does not grow with the number of photos.
struct Found {
  std::string png;  // colour and confidence; empty: nothing is known
  double reached = 0.0;
};

class PictureCarrier {
 public:
  // The references must outlive the object.
  PictureCarrier(const CarryInputs& inputs, const ViewImages& images, StageContext& context)
      : inputs_(inputs),
        images_(images),
        context_(context),
        canvas_(LongestSide()),
        colorizer_(ColorizerOfKeyView(context)),
        found_(inputs.scene.views.size()) {}

  void Run() {
    CarryCheckpoint done(inputs_.scene, context_);
    std::vector<int> from = inputs_.key_views;
    for (const int view : from) Keep(view, KeyColor(view), 1.0);
    for (int round = 0; round < kRounds && !from.empty(); ++round) {
      const std::vector<Source> sources = SourcesOf(from);
      std::vector<int> open;
      for (size_t i = 0; i < found_.size(); ++i) {
        if (found_[i].reached < kReached) open.push_back(static_cast<int>(i));
      }
      done.ReportProgress(fmt::format("looking for the same things in {} photos", open.size()));
      context_.pool().ForEach(std::ssize(open), [&](int64_t i, int) {
        context_.ThrowIfCancelled();
        CarryInto(open[i], sources);
      });
      from.clear();
      for (const int view : open) {
        if (found_[view].reached >= kReached) from.push_back(view);
      }
      std::ranges::stable_sort(
          from, std::ranges::greater(), [&](int view) { return found_[view].reached; });
      from.resize(std::min(from.size(), kMaxSources));
    }
    for (size_t i = 0; i < found_.size(); ++i) {
      context_.ThrowIfCancelled();
      const int view = static_cast<int>(i);
      if (done.WasDone(view)) continue;
      CarriedColor color = Color(view);
      if (colorizer_ && !inputs_.IsKeyView(view)) AddAutomatic(view, &color);
      done.Add(view, CoveredShare(color), EncodeAbPng(color.ab, color.confidence));
    }
    WarnOfSmallCoverage(WriteCoverage(inputs_, done.coverage(), context_), context_);
  }

 private:
  int LongestSide() const {
    int side = 1;
    for (size_t i = 0; i < inputs_.scene.views.size(); ++i) {
      const Camera camera = images_.WorkingCamera(static_cast<int>(i));
      side = std::max({side, camera.width, camera.height});
    }
    return side;
  }

  CarriedColor KeyColor(int view) const {
    const Camera camera = images_.WorkingCamera(view);
    return view == inputs_.key_views.front()
               ? ReadKeyColor(context_, camera.width, camera.height)
               : ReadAdditionalKeyColor(context_, inputs_.scene, view, images_);
  }

  void Keep(int view, const CarriedColor& color, double reached) {
    found_[view] = {EncodeAbPng(color.ab, color.confidence), reached};
  }

  // Nothing is known of pictures that were not kept.
  CarriedColor Color(int view) const {
    if (found_[view].png.empty()) {
      const Camera camera = images_.WorkingCamera(view);
      return {Image(camera.width, camera.height, 2), Image(camera.width, camera.height, 1)};
    }
    AbMap map = DecodeAbPng(found_[view].png, artifact::kCarried);
    return {std::move(map.ab), std::move(map.confidence)};
  }

  std::vector<Source> SourcesOf(const std::vector<int>& views) const {
    std::vector<Source> sources(views.size());
    context_.pool().ForEach(std::ssize(views), [&](int64_t i, int) {
      Source& source = sources[i];
      source.view = views[i];
      const CarriedColor color = Color(source.view);
      source.key = {source.view,
                    {canvas_.Put(color.ab, 0.0f), canvas_.Put(color.confidence, 0.0f)}};
      source.luminance = OnCanvas(source.view);
      source.regions = std::make_unique<ReappearingRegions>(*source.luminance);
    });
    return sources;
  }

  std::shared_ptr<const Image> OnCanvas(int view) const {
    const auto luminance = images_.Luminance(view);
    return std::make_shared<const Image>(canvas_.Put(*luminance, 50.0f));
  }

  void CarryInto(int view, const std::vector<Source>& sources) {
    const auto luminance = OnCanvas(view);
    const Camera camera = images_.WorkingCamera(view);
    CarriedColor best = Color(view);
    for (const Source& source : sources) {
      const CarriedColor found = CarryIntoReappearing(
          source.key, *source.regions, *luminance, inputs_.options.film, context_.cancel());
      const CarriedColor color{canvas_.Take(found.ab, camera.width, camera.height),
                               canvas_.Take(found.confidence, camera.width, camera.height)};
      if (Coverage(color, kDecisiveConfidence) < kMinReached) continue;
      KeepMoreConfident(color, &best);
    }
    const double reached = Coverage(best, kDecisiveConfidence);
    if (reached >= kMinReached) Keep(view, best, reached);
  }

  void AddAutomatic(int view, CarriedColor* color) const {
    AutomaticColor guess = colorizer_->Colorize(*images_.Luminance(view));
    FillFrom({std::move(guess.ab), std::move(guess.confidence)}, color);
  }

  const CarryInputs& inputs_;
  const ViewImages& images_;
  StageContext& context_;
  Canvas canvas_;
  std::shared_ptr<const AutomaticColorizer> colorizer_;
  std::vector<Found> found_;  // by view
};

}  // namespace

void CarryPictures(const CarryInputs& inputs, StageContext& context) {
  const ViewImages images(inputs.scene, context.scene_folder(), inputs.options.max_side_px);
  PictureCarrier(inputs, images, context).Run();
}

}  // namespace color3d
