// Optical flow and carrying along a film where motion is extreme or pictures are empty.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/film/film_carry.h"
#include "core/metrics/temporal_consistency.h"
#include "tests/stability/tiny_problem.h"
#include "tests/support/scenes/textured_corner.h"

namespace color3d {
namespace {

constexpr int kWidth = 320, kHeight = 180;
constexpr float kA = 40.0f, kB = -25.0f;

// A textured backdrop, shifted to the left by `shift` px: L in 0..100.
Image Backdrop(double shift) {
  Image l(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      l.At(0, y, x) = 100.0f * CornerTexture(0.02 * (x + shift), 0.02 * y, 4);
    }
  }
  return l;
}

// Flow between two frames of which one is shifted. `most_wrong`: share of all pixels whose flow is
// accepted and wrong.
StabilityResult RunFlow(double shift_px, double most_wrong) {
  const FollowedPixels followed = FollowToPreviousFrame(Backdrop(shift_px), Backdrop(0.0));
  StabilityResult r;
  r.condition_of = "-";
  r.non_finite = CountNonFinite(followed.place.data.data(), followed.place.data.size());
  int64_t accepted = 0, wrong = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (followed.sure[static_cast<size_t>(y) * kWidth + x] == 0) continue;
      ++accepted;
      const double error =
          std::hypot(followed.place.At(0, y, x) - (x + shift_px), followed.place.At(1, y, x) - y);
      wrong += error > 2.0 ? 1 : 0;
    }
  }
  r.compared = accepted;
  r.value_error = accepted > 0 ? static_cast<double>(wrong) / (kWidth * kHeight) : 0.0;
  r.value_bound = most_wrong;
  char text[80];
  std::snprintf(text,
                sizeof(text),
                "%.0f %% of the pixels followed, %.0f %% wrongly",
                100.0 * accepted / (kWidth * kHeight),
                100.0 * wrong / (kWidth * kHeight));
  r.outcome = text;
  return r;
}

// Carries one colour from the first frame along `frames`. Everything carried has that colour.
// `least` and `most`: bounds of the mean confidence in the last frame.
StabilityResult RunFilm(const std::vector<Image>& frames,
                        double least,
                        double most,
                        ThreadPool& pool) {
  FilmFrames film;
  film.shot.assign(frames.size(), 0);
  film.luminance = [&](int frame) { return std::make_shared<const Image>(frames[frame]); };
  CarriedColor key{Image(kWidth, kHeight, 2), Image(kWidth, kHeight, 1, 1.0f)};
  std::fill_n(key.ab.Plane(0), key.ab.PlaneSize(), kA);
  std::fill_n(key.ab.Plane(1), key.ab.PlaneSize(), kB);
  StabilityResult r;
  r.condition_of = "-";
  r.value_error = 0.0;
  double mean = 0.0;
  size_t calls = 0;
  CarryAlongFilm(
      film,
      {{0, key}},
      FilmCarryOptions(),
      pool,
      {},
      {[&](int frame, const CarriedColor& c) {
         ++calls;
         r.non_finite += CountNonFinite(c.ab.data.data(), c.ab.data.size()) +
                         CountNonFinite(c.confidence.data.data(), c.confidence.data.size());
         r.compared += static_cast<int64_t>(c.confidence.data.size());
         double sum = 0.0;
         for (size_t i = 0; i < c.confidence.data.size(); ++i) {
           sum += c.confidence.data[i];
           if (c.confidence.data[i] < 1e-3f) continue;
           r.value_error = std::max({r.value_error,
                                     std::abs(c.ab.data[i] - kA) / 50.0,
                                     std::abs(c.ab.data[c.ab.PlaneSize() + i] - kB) / 50.0});
         }
         if (frame + 1 == static_cast<int>(frames.size())) {
           mean = sum / static_cast<double>(c.confidence.data.size());
         }
       },
       {}});
  r.value_bound = 1e-4;
  r.held = calls == frames.size() && mean >= least && mean <= most;
  char text[80];
  std::snprintf(text, sizeof(text), "mean confidence in the last frame %.2f", mean);
  r.outcome = text;
  return r;
}

}  // namespace

void AddFilmCases(std::vector<StabilityCase>& cases) {
  const auto flow = [&](const std::string& name, double shift_px, double most_wrong) {
    cases.push_back(
        {"film", name, false, [=](ThreadPool&) { return RunFlow(shift_px, most_wrong); }});
  };
  flow("flow of 2 px in 320", 2.0, 0.01);
  flow("flow of 20 px in 320", 20.0, 0.01);
  // Beyond the reach of the flow. Motion that forward and backward flow agree on by chance stays.
  flow("flow of 200 px in 320", 200.0, 0.2);
  const auto film = [&](const std::string& name, double least, double most, auto make) {
    cases.push_back({"film", name, false, [=](ThreadPool& pool) {
                       return RunFilm(make(), least, most, pool);
                     }});
  };
  film("one frame", 0.9, 1.0, [] { return std::vector<Image>{Backdrop(0.0)}; });
  film("black frames", 0.0, 1.0, [] {
    return std::vector<Image>(3, Image(kWidth, kHeight, 1, 0.0f));
  });
  film("a black frame in between", 0.0, 1.0, [] {
    return std::vector<Image>{Backdrop(0.0), Image(kWidth, kHeight, 1, 0.0f), Backdrop(4.0)};
  });
  film("a white flash", 0.0, 1.0, [] {
    return std::vector<Image>{Backdrop(0.0), Image(kWidth, kHeight, 1, 100.0f), Backdrop(4.0)};
  });
  film("a jump of 200 px", 0.0, 0.6, [] {
    return std::vector<Image>{Backdrop(0.0), Backdrop(200.0)};
  });
  film("another picture", 0.0, 0.1, [] {
    return std::vector<Image>{Backdrop(0.0), Backdrop(1e4)};
  });
  film("grain of 100 L", 0.0, 0.2, [] {
    std::vector<Image> frames(2, Image(kWidth, kHeight, 1));
    Random random(8);
    for (Image& frame : frames) {
      for (float& v : frame.data) v = static_cast<float>(random.NextUniform(0.0, 100.0));
    }
    return frames;
  });
}

}  // namespace color3d
