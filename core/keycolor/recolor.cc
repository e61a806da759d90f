#include "core/keycolor/recolor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/image/image_checks.h"
#include "core/keycolor/picture_checks.h"

namespace color3d {
namespace {

// Difference of chroma (Lab units) that counts as an edit: twice the rounding of 8 bits per
// channel.
constexpr float kMinChange = 2.0f;
constexpr int kFeatherPx = 2;

void CheckPicture(const Image& picture, const char* what, const Image& original) {
  if (picture.width != original.width || picture.height != original.height) {
    throw InvalidArgument("{} is {} px, but the key view {}; save it at the size of the key view",
                          what,
                          SizeText(picture),
                          SizeText(original));
  }
  if (!IsFinite(picture)) throw InvalidArgument("{} has a value that is not finite", what);
}

// Returns 1 where colour may change.
std::vector<uint8_t> Allowed(const Image* mask, const Image& original) {
  std::vector<uint8_t> allowed(original.PlaneSize(), 1);
  if (mask == nullptr) return allowed;
  CheckPicture(*mask, "the mask", original);
  const int colors = mask->channels >= 3 ? 3 : 1;
  int64_t count = 0;
  for (size_t i = 0; i < allowed.size(); ++i) {
    float sum = 0.0f;
    for (int c = 0; c < colors; ++c) sum += mask->Plane(c)[i];
    allowed[i] = sum > 0.5f * static_cast<float>(colors);
    count += allowed[i];
  }
  if (count == 0) {
    throw InvalidArgument(
        "the mask allows no change (nowhere is it brighter than 0.5); paint white "
        "where colour may change");
  }
  return allowed;
}

// Returns the share of the edit: 0 outside, rising to 1 over the first pixels inside. Distances are
// city-block steps from the outside, so that the outermost pixels inside have a share above 0.
std::vector<float> Shares(const std::vector<uint8_t>& allowed, int width, int height) {
  std::vector<float> shares(allowed.begin(), allowed.end());
  std::vector<uint8_t> left = allowed;  // not yet reached from the outside
  for (int step = 1; step <= kFeatherPx; ++step) {
    std::vector<uint8_t> next = left;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const size_t i = static_cast<size_t>(y) * width + x;
        if (!left[i]) continue;
        const bool border = (x > 0 && !left[i - 1]) || (x + 1 < width && !left[i + 1]) ||
                            (y > 0 && !left[i - width]) || (y + 1 < height && !left[i + width]);
        if (!border) continue;
        next[i] = 0;
        shares[i] = static_cast<float>(step) / static_cast<float>(kFeatherPx + 1);
      }
    }
    left.swap(next);
  }
  return shares;
}

}  // namespace

Image KeyColorFromEdit(const Image& original_srgb, const Image& edited_srgb, const Image* mask) {
  if (original_srgb.channels != 3 || original_srgb.Empty()) {
    throw InvalidArgument("recolouring needs a key photo in colour, but it has {} channels",
                          original_srgb.channels);
  }
  if (edited_srgb.channels != 3) {
    throw InvalidArgument("the edited picture has {} channels, but must have 3 (RGB)",
                          edited_srgb.channels);
  }
  CheckPicture(edited_srgb, "the edited picture", original_srgb);
  const std::vector<uint8_t> allowed = Allowed(mask, original_srgb);
  const Image before = LabFromSrgb(original_srgb);
  const Image after = LabFromSrgb(edited_srgb);
  ExpectSameSubject(before, after, "the edited picture");
  const std::vector<float> shares = Shares(allowed, before.width, before.height);
  Image ab(before.width, before.height, 2);
  bool changed = false;
  for (size_t i = 0; i < ab.PlaneSize(); ++i) {
    const float da = after.Plane(1)[i] - before.Plane(1)[i];
    const float db = after.Plane(2)[i] - before.Plane(2)[i];
    if (allowed[i] && std::hypot(da, db) > kMinChange) changed = true;
    ab.Plane(0)[i] = before.Plane(1)[i] + shares[i] * da;
    ab.Plane(1)[i] = before.Plane(2)[i] + shares[i] * db;
  }
  if (!changed) {
    throw InvalidArgument("the edited picture has the key photo's colours{}; nothing would change",
                          (mask != nullptr ? " inside the mask" : ""));
  }
  return ab;
}

Image EditedShare(const Image& original_ab, const Image& edited_ab) {
  Image share(original_ab.width, original_ab.height, 1);
  for (size_t i = 0; i < share.data.size(); ++i) {
    const float change = std::hypot(edited_ab.Plane(0)[i] - original_ab.Plane(0)[i],
                                    edited_ab.Plane(1)[i] - original_ab.Plane(1)[i]);
    share.data[i] = std::clamp(change / kMinChange - 1.0f, 0.0f, 1.0f);
  }
  return share;
}

}  // namespace color3d
