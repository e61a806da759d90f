#include "core/splat/geometry/geometry_state.h"

#include <fmt/format.h>

#include <utility>

namespace color3d {
namespace {

template <class Archive, class State>
void VisitGeometryState(Archive& archive, State& state) {
  VisitState(archive, state);
  archive.Vector(state.statistics.gradient);
  archive.Vector(state.statistics.count);
  archive.Vector(state.statistics.radius);
  archive.Block(state.moving.parameters);
  archive.Block(state.moving.moments.first);
  archive.Block(state.moving.moments.second);
  archive.Block(state.hexplane.planes);
  archive.Block(state.hexplane.network);
  archive.Block(state.hexplane.plane_moments.first);
  archive.Block(state.hexplane.plane_moments.second);
  archive.Block(state.hexplane.network_moments.first);
  archive.Block(state.hexplane.network_moments.second);
  archive.Value(state.hexplane.steps);
  archive.Value(state.densified_at);
  archive.Vector(state.exposures);
}

}  // namespace

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
