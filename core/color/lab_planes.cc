#include "core/color/lab_planes.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"

namespace color3d {
namespace {

Image Planes(const Image& lab, int first, int count) {
  if (lab.channels != 3) {
    throw InvalidArgument("a Lab picture has 3 channels, this one has {}", lab.channels);
  }
  Image part(lab.width, lab.height, count);
  std::copy_n(lab.Plane(first), part.data.size(), part.data.begin());
  return part;
}

}  // namespace

Image LuminanceOfLab(const Image& lab) { return Planes(lab, 0, 1); }
Image ChromaOfLab(const Image& lab) { return Planes(lab, 1, 2); }

}  // namespace color3d
