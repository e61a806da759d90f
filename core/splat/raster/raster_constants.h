// The numbers of the rasterizer. Those that change pictures are those of the reference renderer of
// 3D Gaussian splatting (Kerbl et al. 2023; diff-gaussian-rasterization), unless said otherwise.
#pragma once

namespace color3d {

// A Gaussian is drawn when its centre lies farther than this in front of the camera, world units.
inline constexpr float kNearPlane = 0.2f;
// Added to the diagonal of every 2D covariance, px^2: a splat is at least about a pixel wide.
inline constexpr float kCovarianceDilation = 0.3f;
// The projection's Jacobian is clamped beyond 1.3 x the field of view.
inline constexpr float kFrustumMargin = 0.3f;
inline constexpr float kMaxAlpha = 0.99f;
inline constexpr float kLog2MaxAlpha = -0.014499569f;  // log2(0.99)
// Smaller alphas are not drawn.
inline constexpr float kMinAlpha = 1.0f / 255.0f;
inline constexpr float kLog2MinAlpha = -7.9943534f;  // log2(1/255)
// A pixel is done when less light than this comes through.
inline constexpr float kMinTransmittance = 1e-4f;

// Our own guards against overflow of float32: log scales are clamped, and splats larger on the
// screen are shrunk, so that no product of theirs overflows.
inline constexpr float kMinLogScale = -30.0f;
inline constexpr float kMaxLogScale = 16.0f;
inline constexpr float kMaxSplatVariancePx2 = 1e12f;

// A tile is 16x16 px: 16 blocks of 4x4 px, row by row. One vector holds a block.
inline constexpr int kTileSide = 16;
inline constexpr int kTileBlocks = 16;
inline constexpr int kBlockPixels = 16;
// Bounds of footprints are widened by this much against rounding; the pixel test itself decides.
inline constexpr float kBoundSlackPx = 0.02f;

}  // namespace color3d
