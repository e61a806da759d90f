// Visibility between the views of a scene, for the choice of key views. Stateless; runs on the
// pool's threads.
#pragma once

#include <filesystem>
#include <vector>

#include "core/base/run_control.h"
#include "core/keyview/expected_error.h"
#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Sample locations of a view, row by row.
struct SampleGrid {
  int columns = 0;
  int rows = 0;
  int samples() const { return columns * rows; }
  // Location of sample s, 0..1 of the picture's width and height.
  double X(int s) const { return (s % columns + 0.5) / columns; }
  double Y(int s) const { return (s / columns + 0.5) / rows; }
};
// The grid for scenes with this number of views.
SampleGrid GridFor(int views);

// Samples by the geometry: sample s of view k is location s of `grid` in scene.views[views[k]]. A
// view shows it if it shows the surface at the geometry's depth there.
SeenSamples SeenByGeometry(const Scene& scene,
                           const std::vector<int>& views,
                           const GaussianModel& geometry,
                           const SampleGrid& grid,
                           ThreadPool& pool,
                           const CancellationToken& cancel);

// Samples without geometry: the tracked points of a view, and the other views that observe them.
SeenSamples SeenByPoints(const Scene& scene, const std::vector<int>& views);

// Folder that keeps features of photos between jobs; empty: none.
std::filesystem::path FeatureCache(const StageContext& context);

}  // namespace color3d
