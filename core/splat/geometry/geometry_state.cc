#include "core/splat/geometry/geometry_state.h"

#include <fmt/format.h>

#include <utility>

namespace color3d {

std::string GeometryFingerprint(const GeometryProblem& problem,
                                const GeometryOptions& options,
                                int moments,
                                int64_t initial_count) {
  int64_t pixels = 0;
  for (const PosedCamera& view : problem.training) {
    pixels += int64_t{view.camera.width} * view.camera.height;
  }
  std::string text = fmt::format("geometry {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}",
                                 problem.colors ? 3 : 1,
                                 moments,
                                 static_cast<int>(options.deformation),
                                 options.iterations,
                                 options.max_gaussians,
                                 options.sh_degree,
                                 options.time_limit_seconds,
                                 options.ssim_weight,
                                 options.edge_weight,
                                 options.densify_gradient,
                                 options.learning_rate_scale,
                                 options.seed,
                                 problem.training.size(),
                                 problem.held_out.size(),
                                 pixels,
                                 problem.extent,
                                 initial_count);
  if (problem.start != nullptr) {
    text += fmt::format(" joint {} {} {} {}",
                        static_cast<int>(problem.color_space),
                        problem.chroma_sh_degree,
                        problem.start->iteration,
                        problem.start->elapsed_seconds);
  }
  const GeometryTuning tuning = TuningOf(options);
  VisitFields(tuning, [&](const char* name, const auto& value) {
    text += fmt::format(" {}={}", name, value);
  });
  return text;
}

std::string SerializeGeometryState(const GeometryState& state, std::string_view fingerprint) {
  CheckpointWriter writer(fingerprint);
  VisitGeometryState(writer, state);
  return std::move(writer).Finish();
}

bool ParseGeometryState(std::string_view bytes,
                        std::string_view fingerprint,
                        GeometryState& state) {
  CheckpointReader reader(bytes, fingerprint);
  if (!reader.ok()) return false;
  GeometryState read;
  VisitGeometryState(reader, read);
  if (!reader.ok()) return false;
  state = std::move(read);
  return true;
}

}  // namespace color3d
