#include "core/film/film_carry.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/image/optical_flow.h"

namespace color3d {
namespace {

constexpr int kWindowRadius = 2;

float Bilinear(const float* plane, int width, int height, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(width - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(height - 1));
  const int x0 = std::min(static_cast<int>(x), width - 1),
            y0 = std::min(static_cast<int>(y), height - 1);
  const int x1 = std::min(x0 + 1, width - 1), y1 = std::min(y0 + 1, height - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const float* top = plane + static_cast<size_t>(y0) * width;
  const float* bottom = plane + static_cast<size_t>(y1) * width;
  return (1 - fy) * ((1 - fx) * top[x0] + fx * top[x1]) +
         fy * ((1 - fx) * bottom[x0] + fx * bottom[x1]);
}

// Where each pixel of a frame lies in the key frame (px), and how surely.
struct Track {
  Image place;       // 2 channels: x, y
  Image confidence;  // 1 channel
};

Track AtHome(int width, int height) {
  Track track{Image(width, height, 2), Image(width, height, 1, 1.0f)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      track.place.At(0, y, x) = static_cast<float>(x);
      track.place.At(1, y, x) = static_cast<float>(y);
    }
  }
  return track;
}

Image Sampled(const Image& image, const Image& place) {
  Image out(place.width, place.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (size_t i = 0; i < place.PlaneSize(); ++i) {
      out.Plane(c)[i] =
          Bilinear(image.Plane(c), image.width, image.height, place.Plane(0)[i], place.Plane(1)[i]);
    }
  }
  return out;
}

// One step: pixels of `next` are followed into `now`, whose own are followed already.
Track Step(const Track& now,
           const Image& luminance_now,
           const Image& luminance_next,
           const FilmCarryOptions& options) {
  const Image back = DenseFlow(luminance_next, luminance_now);
  const Image there = DenseFlow(luminance_now, luminance_next);
  const int width = back.width, height = back.height;
  Track next{Image(width, height, 2), Image(width, height, 1)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float px = static_cast<float>(x) + back.At(0, y, x);
      const float py = static_cast<float>(y) + back.At(1, y, x);
      const float ex = back.At(0, y, x) + Bilinear(there.Plane(0), width, height, px, py);
      const float ey = back.At(1, y, x) + Bilinear(there.Plane(1), width, height, px, py);
      for (int c = 0; c < 2; ++c) {
        next.place.At(c, y, x) = Bilinear(now.place.Plane(c), width, height, px, py);
      }
      const bool inside = px > -1.0f && py > -1.0f && px < static_cast<float>(width) &&
                          py < static_cast<float>(height);
      const double error = std::hypot(ex, ey) / options.flow_tolerance_px;
      next.confidence.At(0, y, x) =
          inside ? static_cast<float>(options.keep * std::exp(-error * error)) *
                       Bilinear(now.confidence.Plane(0), width, height, px, py)
                 : 0.0f;
    }
  }
  return next;
}

// Steps drift: what is left between the frame and the key frame, warped to it, is taken out.
void Register(const Image& key_luminance, const Image& luminance, Track* track) {
  const Image warped = Sampled(key_luminance, track->place);
  const Image rest = DenseFlow(luminance, warped);
  const Image place = track->place;
  for (int y = 0; y < place.height; ++y) {
    for (int x = 0; x < place.width; ++x) {
      const float dx = rest.At(0, y, x), dy = rest.At(1, y, x);
      if (dx * dx + dy * dy > 4.0f) continue;  // no drift but another thing
      for (int c = 0; c < 2; ++c) {
        track->place.At(c, y, x) = Bilinear(place.Plane(c),
                                            place.width,
                                            place.height,
                                            static_cast<float>(x) + dx,
                                            static_cast<float>(y) + dy);
      }
    }
  }
}

// Mean of |difference| around each pixel.
Image LocalDifference(const Image& one, const Image& other) {
  const int width = one.width, height = one.height;
  Image rows(width, height, 1), out(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int left = std::max(0, x - kWindowRadius),
                right = std::min(width - 1, x + kWindowRadius);
      float sum = 0.0f;
      for (int k = left; k <= right; ++k) sum += std::abs(one.At(0, y, k) - other.At(0, y, k));
      rows.At(0, y, x) = sum / static_cast<float>(right - left + 1);
    }
  }
  for (int y = 0; y < height; ++y) {
    const int top = std::max(0, y - kWindowRadius),
              bottom = std::min(height - 1, y + kWindowRadius);
    for (int x = 0; x < width; ++x) {
      float sum = 0.0f;
      for (int k = top; k <= bottom; ++k) sum += rows.At(0, k, x);
      out.At(0, y, x) = sum / static_cast<float>(bottom - top + 1);
    }
  }
  return out;
}

FilmColor ColorOf(const FilmKey& key,
                  const Image& key_luminance,
                  const Image& luminance,
                  const Track& track,
                  const FilmCarryOptions& options) {
  FilmColor color{Sampled(key.color.ab, track.place), Sampled(key.color.confidence, track.place)};
  const Image difference = LocalDifference(luminance, Sampled(key_luminance, track.place));
  for (size_t i = 0; i < difference.PlaneSize(); ++i) {
    const double d = difference.data[i] / options.luminance_tolerance;
    color.confidence.data[i] *= track.confidence.data[i] * static_cast<float>(std::exp(-d * d));
    if (color.confidence.data[i] > 1e-3f) continue;
    color.confidence.data[i] = color.ab.Plane(0)[i] = color.ab.Plane(1)[i] = 0.0f;
  }
  return color;
}

// A walk away from a key frame, and the frames on it that the key frame colours.
struct Walk {
  const FilmKey* key = nullptr;
  std::vector<int> frames;  // in the order of the walk
};

std::vector<Walk> WalksOf(const FilmFrames& frames, const std::vector<FilmKey>& keys) {
  const int count = static_cast<int>(frames.shot.size());
  std::vector<const FilmKey*> nearest(count, nullptr);
  for (int i = 0; i < count; ++i) {
    for (const FilmKey& key : keys) {
      if (frames.shot[key.frame] != frames.shot[i]) continue;
      if (nearest[i] == nullptr || std::abs(key.frame - i) < std::abs(nearest[i]->frame - i)) {
        nearest[i] = &key;
      }
    }
  }
  std::vector<Walk> walks;
  for (const FilmKey& key : keys) {
    for (const int direction : {1, -1}) {
      Walk walk{&key, {}};
      for (int i = key.frame + direction; i >= 0 && i < count; i += direction) {
        // Frames with faults lie between those of a shot.
        if (nearest[i] == &key) walk.frames.push_back(i);
      }
      if (!walk.frames.empty()) walks.push_back(std::move(walk));
    }
  }
  // The longest first, so that threads end together.
  std::stable_sort(walks.begin(), walks.end(), [](const Walk& x, const Walk& y) {
    return x.frames.size() > y.frames.size();
  });
  return walks;
}

}  // namespace

void FilmCarryOptions::Validate() const {
  const RangeCheck check("film carry option");
  check("flow_tolerance_px", flow_tolerance_px, 0.1, 10);
  check("luminance_tolerance", luminance_tolerance, 1, 100);
  check("keep", keep, 0.5, 1);
}

void CarryAlongFilm(const FilmFrames& frames,
                    const std::vector<FilmKey>& keys,
                    const FilmCarryOptions& options,
                    ThreadPool& pool,
                    const CancellationToken& cancel,
                    const std::function<void(int frame, const FilmColor& color)>& on_frame) {
  options.Validate();
  for (size_t i = 0; i < keys.size(); ++i) {
    if (keys[i].frame < 0 || keys[i].frame >= static_cast<int>(frames.shot.size())) {
      throw InvalidArgument("key frame {} is none of {}", keys[i].frame, frames.shot.size());
    }
    for (size_t k = 0; k < i; ++k) {
      if (keys[k].frame == keys[i].frame) {
        throw InvalidArgument("the frame {} is a key frame twice", keys[i].frame);
      }
    }
  }
  std::mutex handing_over;
  const auto hand_over = [&](int frame, const FilmColor& color) {
    const std::lock_guard lock(handing_over);
    on_frame(frame, color);
  };
  for (const FilmKey& key : keys) hand_over(key.frame, key.color);
  const std::vector<Walk> walks = WalksOf(frames, keys);
  pool.ForEach(static_cast<int64_t>(walks.size()), [&](int64_t index, int) {
    const Walk& walk = walks[index];
    const auto key_luminance = frames.luminance(walk.key->frame);
    auto now = key_luminance;
    Track track = AtHome(now->width, now->height);
    for (const int frame : walk.frames) {
      cancel.ThrowIfCancelled();
      const auto next = frames.luminance(frame);
      track = Step(track, *now, *next, options);
      Register(*key_luminance, *next, &track);
      hand_over(frame, ColorOf(*walk.key, *key_luminance, *next, track, options));
      now = next;
    }
  });
}

}  // namespace color3d
