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
  std::string text = fmt::format("geometry {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}",
                                 problem.colors ? 3 : 1,
                                 moments,
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
  WriteState(state, writer);
  writer.Vector(state.statistics.gradient);
  writer.Vector(state.statistics.count);
  writer.Vector(state.statistics.radius);
  writer.Block(state.moving.parameters);
  writer.Block(state.moving.moments.first);
  writer.Block(state.moving.moments.second);
  writer.Value(state.densified_at);
  writer.Value<uint64_t>(state.exposures.size());
  for (const PhotoExposure& exposure : state.exposures) writer.Value(exposure);
  return std::move(writer).Finish();
}

bool ParseGeometryState(std::string_view bytes,
                        std::string_view fingerprint,
                        GeometryState& state) {
  CheckpointReader reader(bytes, fingerprint);
  if (!reader.ok()) return false;
  GeometryState read;
  ReadState(reader, read);
  read.statistics.gradient = reader.Vector();
  read.statistics.count = reader.Vector();
  read.statistics.radius = reader.Vector();
  read.moving.parameters = reader.Block();
  read.moving.moments.first = reader.Block();
  read.moving.moments.second = reader.Block();
  read.densified_at = reader.Value<int64_t>();
  read.exposures.resize(reader.Count(sizeof(PhotoExposure)));
  for (PhotoExposure& exposure : read.exposures) exposure = reader.Value<PhotoExposure>();
  if (!reader.ok()) return false;
  state = std::move(read);
  return true;
}

}  // namespace color3d
