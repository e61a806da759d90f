#include "core/splat/chroma/chroma_weights.h"

#include <cmath>

#include "core/base/random.h"
#include "core/splat/chroma/chroma_parameters.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "tests/support/instruction_set_testing.h"
#include "tests/support/scenes/chroma_problems.h"

namespace color3d {
namespace {

using chroma_problems::CameraAt;
using chroma_problems::kHeight;
using chroma_problems::kWidth;
using chroma_problems::RandomGaussians;

using TileWeightsTest = InstructionSetTest<int>;

TEST_P(TileWeightsTest, ProductsAgreeWithRasterizer) {
  const GaussianModel geometry = RandomGaussians(TestCase(), 7);
  ChromaParameters p = ChromaParameters::From(geometry, 0);
  Random random(2);
  AlignedFloats value(2 * p.block.count());
  for (int64_t i = 0; i < p.block.count(); ++i) {
    for (int c = 0; c < 2; ++c) {
      value[2 * i + c] = static_cast<float>(random.NextUniform(-0.3, 0.3));
      p.Row(c, 0)[i] = value[2 * i + c] / kShDc;
    }
  }
  p.color.channel[0].base = p.color.channel[1].base = 0.0f;
  const PosedCamera view = CameraAt(0, 0.1);
  const RasterCamera camera = MakeRasterCamera(view.camera, view.cam_from_world);
  ThreadPool pool(1);
  SplatPipeline pipeline;
  const float background[2] = {0.0f, 0.0f};
  pipeline.Forward({p.block, p.color, camera}, background, false, pool);
  SplatBuffer splats;
  TileBinner binner;
  TileLists lists;
  ProjectSplats({p.block, p.color, camera}, false, pool, splats);
  binner.Bin(splats, camera.width, camera.height, pool, lists);
  for (int tile = 0; tile < lists.tile_count(); ++tile) {
    TileWeights w;
    BuildTileWeights(splats, lists, tile, camera.width, camera.height, w);
    std::vector<float> picture(2 * kTilePixels), other(2 * kTilePixels);
    TileForward(w, value.data(), picture.data());
    for (float& v : other) v = static_cast<float>(random.NextUniform(-1.0, 1.0));
    std::vector<float> sum(value.size(), 0.0f);
    TileAdjoint(w, other.data(), sum.data());
    double forward = 0.0, adjoint = 0.0, size = 0.0;
    for (int i = 0; i < 2 * kTilePixels; ++i) {
      forward += static_cast<double>(picture[i]) * other[i];
      size += std::abs(static_cast<double>(picture[i]) * other[i]);
      const int b = i / (2 * kBlockPixels), c = i / kBlockPixels % 2, lane = i % kBlockPixels;
      const int x = tile % lists.tiles_x * kTileSide + PixelX(b, lane);
      const int y = tile / lists.tiles_x * kTileSide + PixelY(b, lane);
      const bool inside = x < kWidth && y < kHeight;
      EXPECT_NEAR(picture[i], inside ? pipeline.color().Row(c, y)[x] : 0.0f, 2e-3);
    }
    for (size_t i = 0; i < value.size(); ++i) adjoint += static_cast<double>(value[i]) * sum[i];
    EXPECT_NEAR(forward, adjoint, 1e-6 * size + 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels,
                         TileWeightsTest,
                         testing::Combine(testing::Values(1, 60, 800), EachInstructionSet()));

}  // namespace
}  // namespace color3d
