// What a scene's views see of each other, for the choice of key views. Functions without state;
// their threads are the pool's.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/run_control.h"
#include "core/keyview/expected_error.h"
#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Places in a picture: samples of a view, row by row.
struct SampleGrid {
  int columns = 0;
  int rows = 0;
  int samples() const { return columns * rows; }
  // Where sample s lies, 0..1 of the picture's width and height.
  double X(int s) const { return (s % columns + 0.5) / columns; }
  double Y(int s) const { return (s / columns + 0.5) / rows; }
};
// For scenes of so many views.
SampleGrid GridFor(int views);

// Sample s of view k is place s of `grid` in scene.views[views[k]]; a view shows it where it shows
// the surface that the geometry's depth puts there.
SeenSamples SeenByGeometry(const Scene& scene,
                           const std::vector<int>& views,
                           const GaussianModel& geometry,
                           const SampleGrid& grid,
                           ThreadPool& pool,
                           const CancellationToken& cancel);

// Without geometry: the samples of a view are tracked points that it sees, and who else sees them.
SeenSamples SeenByPoints(const Scene& scene, const std::vector<int>& views);

// Where features of photos are kept between jobs; empty: nowhere.
std::filesystem::path FeatureCache(const StageContext& context);

}  // namespace color3d
