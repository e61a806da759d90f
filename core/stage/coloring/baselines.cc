// The methods that colour each view by itself.
#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/carry/confidence.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/stage/coloring/view_coloring.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/formats/key_views.h"

namespace color3d {
namespace {

// `plane`: the only source of all pixels (ProvenancePlane).
FusedColor OfOneSource(Image ab, ProvenancePlane plane) {
  FusedColor color{std::move(ab), {}};
  color.provenance = Image(color.ab.width, color.ab.height, kProvenancePlanes);
  std::fill_n(color.provenance.Plane(plane), color.provenance.PlaneSize(), 1.0f);
  return color;
}

void PutGivenColor(const CarriedColor& given, FusedColor* color) {
  for (size_t i = 0; i < given.confidence.data.size(); ++i) {
    const float share = given.confidence.data[i];
    for (int c = 0; c < 2; ++c) {
      float& ab = color->ab.Plane(c)[i];
      ab += share * (given.ab.Plane(c)[i] - ab);
    }
    for (int c = 0; c < kProvenancePlanes; ++c) color->provenance.Plane(c)[i] *= 1.0f - share;
    color->provenance.Plane(kSeenPlane)[i] += share;
  }
}

// `color` is called from several threads.
void ColorEachView(const ViewColoring& coloring,
                   StageContext& context,
                   const std::function<FusedColor(int view, const Image& luminance)>& color) {
  const std::vector<int> keys = KeyViewsOf(coloring.scene, context);
  context.pool().ForEach(std::ssize(coloring.scene.views), [&](int64_t index, int) {
    context.ThrowIfCancelled();
    const auto view = static_cast<int>(index);
    if (coloring.done.WasDone(view)) return;
    FusedColor colored = color(view, *coloring.images.Luminance(view));
    if (std::ranges::find(keys, view) != keys.end()) {
      PutGivenColor(GivenColor(coloring, view, context), &colored);
    }
    coloring.done.Add(view, colored);
  });
}

Image InferredAb(const ViewColoring& coloring, const Image& luminance, Image position) {
  PictureFacts facts;
  facts.position = std::move(position);
  return coloring.colorizer->Predict(luminance, facts).ab;
}

}  // namespace

ViewMethod MethodOf(ColorizeViewsOptions::Method method) {
  using Method = ColorizeViewsOptions::Method;
  switch (method) {
    case Method::kFusion:
      return ColorByFusion;
    case Method::kPersonalized:
      return ColorPersonalized;
    case Method::kNearestNeighbors:
      return ColorByNearestNeighbors;
    case Method::kDecoder:
      return ColorByDecoder;
    case Method::kCarried:
      return ColorCarried;
    case Method::kAutomatic:
      return ColorAutomatically;
    case Method::kFlow:
      return ColorByFlow;
    case Method::kGray:
      return ColorGray;
  }
  throw Error(ErrorCode::kInternal, "there is no method {} of colouring", static_cast<int>(method));
}

std::vector<int> KeyViewsOf(const Scene& scene, const StageContext& context) {
  std::vector<int> views;
  for (const std::string& name : ReadCarryFacts(context).key_views) {
    views.push_back(scene.FindView(name));
  }
  if (!views.empty()) return views;
  return ReadKeyViews(context, scene, AdditionalKeyViewNames(context));
}

CarriedColor GivenColor(const ViewColoring& coloring, int key_view, const StageContext& context) {
  const View& view = coloring.scene.views[key_view];
  const Camera camera = coloring.images.WorkingCamera(key_view);
  // The carried colours of key views are those that were given.
  if (context.HasInput(ViewArtifact(artifact::kCarried, view))) {
    return ReadCarried(context, view, camera.width, camera.height);
  }
  if (key_view != ReadKeyView(context, coloring.scene)) {
    return ReadAdditionalKeyColor(context, coloring.scene, key_view, coloring.images);
  }
  return ReadKeyColor(context, camera.width, camera.height);
}

void ColorPersonalized(const ViewColoring& coloring, StageContext& context) {
  ColorEachView(coloring, context, [&](int view, const Image& luminance) {
    const ViewImages& images = coloring.images;
    Image position =
        coloring.positions.Of(view, images.WorkingCamera(view), luminance, images.Mask(view).get());
    return OfOneSource(InferredAb(coloring, luminance, std::move(position)), kInferredPlane);
  });
}

void ColorByNearestNeighbors(const ViewColoring& coloring, StageContext& context) {
  ColorEachView(coloring, context, [&](int, const Image& luminance) {
    return OfOneSource(InferredAb(coloring, luminance, {}), kInferredPlane);
  });
}

void ColorByDecoder(const ViewColoring& coloring, StageContext& context) {
  ColorEachView(coloring, context, [&](int, const Image& luminance) {
    return OfOneSource(InferredAb(coloring, luminance, {}), kInferredPlane);
  });
}

void ColorCarried(const ViewColoring& coloring, StageContext& context) {
  ColorEachView(coloring, context, [&](int view, const Image& luminance) {
    CarriedColor carried =
        ReadCarried(context, coloring.scene.views[view], luminance.width, luminance.height);
    FusedColor color = OfOneSource(std::move(carried.ab), kSeenPlane);
    for (size_t i = 0; i < carried.confidence.data.size(); ++i) {
      if (carried.confidence.data[i] > kMinMatchProbability) continue;
      for (int c = 0; c < 2; ++c) color.ab.Plane(c)[i] = 0.0f;
      color.provenance.Plane(kSeenPlane)[i] = 0.0f;
      color.provenance.Plane(kGuessedPlane)[i] = 1.0f;
    }
    return color;
  });
}

void ColorAutomatically(const ViewColoring& coloring, StageContext& context) {
  const auto automatic = AutomaticColorizer::Embedded();
  ColorEachView(coloring, context, [&](int, const Image& luminance) {
    return OfOneSource(automatic->Colorize(luminance).ab, kGuessedPlane);
  });
}

void ColorGray(const ViewColoring& coloring, StageContext& context) {
  ColorEachView(coloring, context, [](int, const Image& luminance) {
    return OfOneSource(Image(luminance.width, luminance.height, 2), kGuessedPlane);
  });
}

}  // namespace color3d
