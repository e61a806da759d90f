#include "core/stage/formats/edited_share.h"

#include <algorithm>
#include <utility>

#include "core/image/codec.h"
#include "core/image/weighted_resize.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/key_views.h"

namespace color3d {
namespace {

constexpr int kConfidencePlane = 2;
constexpr int kEditedPlane = 3;

Image PlaneOf(const Image& image, int plane) {
  Image out(image.width, image.height, 1);
  std::copy_n(image.Plane(plane), out.data.size(), out.data.begin());
  return out;
}

}  // namespace

void AddEditedShare(const Image& share, Image* ab) {
  if (share.Empty()) return;
  ++ab->channels;
  ab->data.insert(ab->data.end(), share.data.begin(), share.data.end());
}

std::string EncodeCarriedPng(const CarriedColor& color) {
  if (color.ab.channels == 2) return EncodeAbPng(color.ab, color.confidence);
  Image packed(color.ab.width, color.ab.height, 4);
  const size_t n = packed.PlaneSize();
  for (size_t i = 0; i < 2 * n; ++i) packed.data[i] = (color.ab.data[i] + 128.0f) / 255.0f;
  std::copy_n(color.confidence.data.begin(), n, packed.Plane(kConfidencePlane));
  std::copy_n(color.ab.Plane(2), n, packed.Plane(kEditedPlane));
  return EncodePng16(packed);
}

CarriedColor DecodeCarriedPng(const std::string& png, const std::string& name) {
  AbMap map = DecodeAbPng(png, name);
  if (ProbeImage(png, name).channels == 4) {
    AddEditedShare(PlaneOf(DecodeImage(png, name, /*keep_alpha=*/true), kEditedPlane), &map.ab);
  }
  return {std::move(map.ab), std::move(map.confidence)};
}

Image ReadEditedShare(const StageContext& context, const std::string& name, int width, int height) {
  if (!context.HasInput(name)) return {};
  const std::string bytes = context.ReadInput(name);
  if (ProbeImage(bytes, name).channels != 4) return {};
  const Image packed = DecodeImage(bytes, name, /*keep_alpha=*/true);
  return ResizeWeighted(
      PlaneOf(packed, kEditedPlane), PlaneOf(packed, kConfidencePlane), width, height);
}

Image ReadAdditionalEditedShare(const StageContext& context,
                                const Scene& scene,
                                int view,
                                const ViewImages& images) {
  const Camera camera = images.WorkingCamera(view);
  const std::string file = AdditionalKeyViewFolder(context, scene, view) + artifact::kKeyColor;
  Image share = ReadEditedShare(context, file, camera.width, camera.height);
  return share.Empty() ? Image(camera.width, camera.height, 1, 1.0f) : share;
}

}  // namespace color3d
