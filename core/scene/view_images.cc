#include "core/scene/view_images.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <list>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/mutex.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/decode_budget.h"
#include "core/image/reduced.h"
#include "core/scene/cubic_remap.h"
#include "core/scene/lens.h"
#include "core/scene/photo_masks.h"
#include "core/scene/photos.h"

namespace color3d {
namespace {

// Positions in the (reduced) photo.
RemapTable MakeRemap(const Camera& captured, const Distortion& distortion, const Camera& camera) {
  RemapTable table{camera.width, camera.height, {}, {}};
  table.x.reserve(static_cast<size_t>(camera.width) * camera.height);
  table.y.reserve(table.x.capacity());
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const Eigen::Vector2d seen =
          ProjectCaptured(captured, distortion, camera.Ray(column + 0.5, row + 0.5));
      table.x.push_back(static_cast<float>(seen.x() - 0.5));
      table.y.push_back(static_cast<float>(seen.y() - 0.5));
    }
  }
  return table;
}

auto CameraKey(const Camera& c) { return std::tie(c.width, c.height, c.fx, c.fy, c.cx, c.cy); }
bool SameLens(const View& x, const View& y) {
  return CameraKey(x.captured_camera) == CameraKey(y.captured_camera) &&
         CameraKey(x.camera) == CameraKey(y.camera) && x.distortion.model == y.distortion.model &&
         x.distortion.k == y.distortion.k;
}

}  // namespace

struct ViewImages::Impl {
  const Scene& scene;
  const std::filesystem::path folder;
  const int max_side_px;
  const int64_t budget_bytes;

  std::vector<int> lens_of_view;  // index of the first view with the same lens
  std::deque<Mutex> loading;      // one per view: each picture is decoded once
  Mutex mutex;
  // By view; masks by MaskKey().
  std::map<int, std::shared_ptr<const Image>> cached COLOR3D_GUARDED_BY(mutex);
  std::list<int> recent COLOR3D_GUARDED_BY(mutex);  // most recently used first
  int64_t cached_bytes COLOR3D_GUARDED_BY(mutex) = 0;
  // By lens, most recently used first.
  std::list<std::pair<int, std::shared_ptr<const RemapTable>>> tables COLOR3D_GUARDED_BY(mutex);

  Impl(const Scene& s, std::filesystem::path f, int side, int64_t budget)
      : scene(s),
        folder(std::move(f)),
        max_side_px(side),
        budget_bytes(budget),
        loading(s.views.size()) {
    for (size_t i = 0; i < scene.views.size(); ++i) {
      size_t first = 0;
      while (!SameLens(scene.views[first], scene.views[i])) ++first;
      lens_of_view.push_back(static_cast<int>(first));
    }
  }

  const View& At(int view) const {
    if (view < 0 || view >= static_cast<int>(scene.views.size())) {
      throw InvalidArgument("view {} does not exist; the scene has {}", view, scene.views.size());
    }
    return scene.views[view];
  }

  // Undistortion runs at no more than twice the working size: sharp enough, and it bounds tables
  // and times for photos of 50 megapixels.
  int RemapSide() const { return max_side_px > 0 ? 2 * max_side_px : 0; }

  std::shared_ptr<const RemapTable> FindTable(int view) {
    constexpr size_t kMaxTables = 4;
    const int lens = lens_of_view[view];
    {
      const MutexLock lock(mutex);
      for (auto it = tables.begin(); it != tables.end(); ++it) {
        if (it->first != lens) continue;
        tables.splice(tables.begin(), tables, it);
        return tables.front().second;
      }
    }
    const View& v = scene.views[view];
    auto table = std::make_shared<const RemapTable>(MakeRemap(
        v.captured_camera.FitWithin(RemapSide()), v.distortion, v.camera.FitWithin(RemapSide())));
    const MutexLock lock(mutex);
    tables.emplace_front(lens, table);
    if (tables.size() > kMaxTables) tables.pop_back();
    return table;
  }

  void RequireCapturedSize(const View& v, int width, int height) const {
    const Camera& c = v.captured_camera;
    if (width == c.width && height == c.height) return;
    throw InvalidArgument("view {} was captured at {} but this picture of it has {}",
                          v.name,
                          SizeText(c.width, c.height),
                          SizeText(width, height));
  }

  // Size at which a picture of size `own` is undistorted; the working size if there is no
  // distortion.
  PictureSize SizeBeforeRemap(const View& v, const PictureSize& own) const {
    if (!IsUndistorted(v.distortion)) return SizeWithin(own, RemapSide());
    const Camera working = v.camera.FitWithin(max_side_px);
    return {working.width, working.height};
  }

  // Requires: the picture has that size.
  Image FromSizeBeforeRemap(int view, Image picture) {
    const View& v = At(view);
    if (IsUndistorted(v.distortion)) return picture;
    const Camera working = v.camera.FitWithin(max_side_px);
    return Resize(CubicRemap(picture, *FindTable(view)), working.width, working.height);
  }

  Image Undistorted(int view, const Image& captured) {
    const View& v = At(view);
    RequireCapturedSize(v, captured.width, captured.height);
    const PictureSize size = SizeBeforeRemap(v, {captured.width, captured.height});
    return FromSizeBeforeRemap(view, Resize(captured, size.width, size.height));
  }

  // sRGB or grey, undistorted, working size.
  Image UndistortedFile(int view, const std::filesystem::path& file) {
    const View& v = At(view);
    return FromSizeBeforeRemap(view, ReadImageResized(file, [&](const PictureSize& own) {
                                 RequireCapturedSize(v, own.width, own.height);
                                 return SizeBeforeRemap(v, own);
                               }));
  }

  Image Load(int view) { return UndistortedFile(view, folder / At(view).image_file); }

  int MaskKey(int view) const { return view + static_cast<int>(scene.views.size()); }

  std::shared_ptr<const Image> FindCached(int view) {
    const MutexLock lock(mutex);
    const auto it = cached.find(view);
    if (it == cached.end()) return nullptr;
    recent.remove(view);
    recent.push_front(view);
    return it->second;
  }

  void Keep(int view, const std::shared_ptr<const Image>& image) {
    const int64_t bytes = static_cast<int64_t>(image->data.size() * sizeof(float));
    const MutexLock lock(mutex);
    if (bytes > budget_bytes) return;
    cached[view] = image;
    recent.push_front(view);
    cached_bytes += bytes;
    while (cached_bytes > budget_bytes) {
      const int oldest = recent.back();
      recent.pop_back();
      cached_bytes -= static_cast<int64_t>(cached[oldest]->data.size() * sizeof(float));
      cached.erase(oldest);
    }
  }
};

ViewImages::ViewImages(const Scene& scene,
                       std::filesystem::path scene_folder,
                       int max_side_px,
                       int64_t cache_budget_bytes)
    : impl_(std::make_unique<Impl>(
          scene, std::move(scene_folder), max_side_px, cache_budget_bytes)) {}

ViewImages::~ViewImages() = default;

Camera ViewImages::WorkingCamera(int view) const {
  return impl_->At(view).camera.FitWithin(impl_->max_side_px);
}

std::shared_ptr<const Image> ViewImages::Luminance(int view) const {
  impl_->At(view);
  if (auto image = impl_->FindCached(view)) return image;
  const MutexLock lock(impl_->loading[view]);
  if (auto image = impl_->FindCached(view)) return image;
  auto image = std::make_shared<const Image>(LuminanceFromSrgb(impl_->Load(view)));
  impl_->Keep(view, image);
  return image;
}

std::shared_ptr<const Image> ViewImages::Mask(int view) const {
  const View& v = impl_->At(view);
  if (v.mask_file.empty()) return nullptr;
  const int key = impl_->MaskKey(view);
  const MutexLock lock(impl_->loading[view]);
  if (auto mask = impl_->FindCached(key)) return mask;
  const Camera& c = v.captured_camera;
  const PictureTurn turn(MaskNeed(v.mask_file, c.width, c.height));
  const Image mask = impl_->Undistorted(
      view, ReadMask(impl_->folder, v.mask_file, v.image_file, c.width, c.height));
  auto whole = std::make_shared<const Image>(ResizeMask(mask, mask.width, mask.height));
  impl_->Keep(key, whole);
  return whole;
}

Image ViewImages::Srgb(int view) const {
  Image image = impl_->Load(view);
  if (image.channels == 3) return image;
  Image srgb(image.width, image.height, 3);
  for (int c = 0; c < 3; ++c) std::ranges::copy(image.data, srgb.Plane(c));
  return srgb;
}

Image ViewImages::Undistort(int view, const Image& captured) const {
  return impl_->Undistorted(view, captured);
}

Image ViewImages::UndistortFile(int view, const std::filesystem::path& file) const {
  return impl_->UndistortedFile(view, file);
}

}  // namespace color3d
