#include "core/carry/fusion.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/range_check.h"
#include "core/carry/confidence.h"
#include "core/grid/edge_weights.h"
#include "core/grid/grid_solver.h"

namespace color3d {
namespace {

constexpr double kTolerance = 1e-3;
constexpr double kMinPull = 1e-6;  // keeps the system definite
constexpr double kMaxStrange =
    4.0;  // feature distance above which all places are equally unfamiliar

void CheckSize(const char* what, const Image& image, int channels, const Image& luminance) {
  if (image.width != luminance.width || image.height != luminance.height ||
      image.channels != channels) {
    throw InvalidArgument("fusion: the {} picture is {}x{}x{}, expected {}x{}x{}",
                          what,
                          image.width,
                          image.height,
                          image.channels,
                          luminance.width,
                          luminance.height,
                          channels);
  }
}

double SmoothStep(double x, double begin, double end) {
  const double t = std::clamp((x - begin) / (end - begin), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

struct GuessShare {
  double share = 0.0;  // share of the inferred colour that the guess replaces
  double color = 0.0;  // factor of the guess in the prior
};

GuessShare InferredShare(double distance, double chroma, const FusionOptions& options) {
  const double faded =
      options.max_guessed * SmoothStep(distance, options.guess_begins, options.guess_ends);
  const double bold =
      SmoothStep(distance, options.bold_distance_begins, options.bold_distance_ends) *
      SmoothStep(chroma, options.bold_chroma_begins, options.bold_chroma_ends);
  return {std::max(faded, bold), std::max(options.guess_chroma * faded, bold)};
}

}  // namespace

void FusionOptions::Validate() const {
  const RangeCheck check("fusion option");
  check("inferred_weight", inferred_weight, 1e-6, 1e3);
  check("min_confidence", min_confidence, 0, 1);
  check("edge_sigma", edge_sigma, 0.01, 100);
  check("guess_begins", guess_begins, 0, 1e6);
  check("guess_ends", guess_ends, guess_begins + 1e-6, 2e6);
  check("max_guessed", max_guessed, 0, 1);
  check("guess_chroma", guess_chroma, 0, 1);
  check("bold_distance_begins", bold_distance_begins, 0, 1e6);
  check("bold_distance_ends", bold_distance_ends, bold_distance_begins + 1e-6, 2e6);
  check("bold_chroma_begins", bold_chroma_begins, 0, 200);
  check("bold_chroma_ends", bold_chroma_ends, bold_chroma_begins + 1e-6, 400);
}

FusedColor FuseColors(const FusionSources& sources,
                      const FusionOptions& options,
                      ThreadPool& pool,
                      const CancellationToken& cancel) {
  options.Validate();
  const auto& [luminance, carried, inferred, distance, guessed] = sources;
  CheckSize("carried", carried.ab, 2, luminance);
  CheckSize("confidence", carried.confidence, 1, luminance);
  CheckSize("inferred", inferred, 2, luminance);
  if (!distance.Empty()) CheckSize("distance", distance, 1, luminance);
  if (!guessed.Empty()) CheckSize("guessed", guessed, 2, luminance);
  const size_t pixels = luminance.PlaneSize();
  FusedColor out{Image(luminance.width, luminance.height, 2),
                 Image(luminance.width, luminance.height, kProvenancePlanes)};
  GridSystem system = SystemOfLuminance(luminance, options.edge_sigma, pool);
  std::vector<float> target(2 * pixels);
  for (size_t i = 0; i < pixels; ++i) {
    const double confidence = carried.confidence.data[i];
    const double seen = confidence > options.min_confidence ? confidence * confidence : 0.0;
    const double guess_a = guessed.Empty() ? 0.0 : guessed.Plane(0)[i];
    const double guess_b = guessed.Empty() ? 0.0 : guessed.Plane(1)[i];
    const GuessShare guess =
        distance.Empty() ? GuessShare{}
                         : InferredShare(distance.data[i], std::hypot(guess_a, guess_b), options);
    const double strangeness =
        distance.Empty() ? 0.0 : std::min<double>(distance.data[i], kMaxStrange);
    const double pull =
        (1.0 - seen) * options.inferred_weight / (1.0 + strangeness * strangeness) + kMinPull;
    const double total = seen + pull;
    const double scale = options.relative_chroma.Scale(luminance.data[i]);
    for (int c = 0; c < 2; ++c) {
      const double prior =
          (1.0 - guess.share) * inferred.Plane(c)[i] + guess.color * (c == 0 ? guess_a : guess_b);
      target[c * pixels + i] =
          static_cast<float>((seen * carried.ab.Plane(c)[i] + pull * prior) / (total * scale));
    }
    system.data[static_cast<int64_t>(i)] = static_cast<float>(total);
    const double share_seen = seen / total;
    out.provenance.Plane(kGuessedPlane)[i] = static_cast<float>((1.0 - share_seen) * guess.share);
    out.provenance.Plane(kSeenPlane)[i] = static_cast<float>(share_seen);
    out.provenance.Plane(kInferredPlane)[i] =
        static_cast<float>((1.0 - share_seen) * (1.0 - guess.share));
  }
  if (options.spread) {
    GridSolveOptions solve;
    solve.tolerance = kTolerance;
    const auto ignore = [](int, double) {};
    GridSolution solved = SolveGridSystem(std::move(system), target, solve, pool, ignore, cancel);
    out.ab.data = std::move(solved.u);
  } else {
    out.ab.data = std::move(target);
  }
  out.ab = FromRelative(options.relative_chroma, luminance, std::move(out.ab));
  return out;
}

}  // namespace color3d
