// A deformation of all Gaussians by feature planes of space and time (DYNAMIC.md "HexPlane"). A
// plain value.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace color3d {

// Planes of two of the axes x, y, z and t (3), in the order of files and kernels.
inline constexpr int kHexPlanes = 6;
inline constexpr int kHexPlaneAxes[kHexPlanes][2] = {
    {0, 1}, {0, 2}, {1, 2}, {0, 3}, {1, 3}, {2, 3}};
inline constexpr int kTimeAxis = 3;
// Offsets of position (3), log scale (3) and rotation (4); one head of the network each.
inline constexpr int kOffsets = 10;
inline constexpr int kOffsetHeads = 3;
inline constexpr int kFirstOffsetOfHead[kOffsetHeads + 1] = {0, 3, 6, kOffsets};
inline constexpr int kOffsetStride = 16;  // columns of the last layer, those from kOffsets on zero
inline constexpr int kMaxHexPlaneLevels = 4;

struct HexPlaneShape {
  // Samples along each axis of space, and of time; at least 2.
  struct Level {
    int space = 2;
    int time = 2;
    bool operator==(const Level&) const = default;
  };

  double begin_s = 0.0;
  double end_s = 0.0;              // >= begin_s
  std::array<float, 3> low = {};   // box of the planes, world; positions outside are clamped
  std::array<float, 3> high = {};  // > low
  float extent = 1.0f;             // > 0: world units of a position offset of 1
  int features = 16;               // of each sample; a multiple of 16
  int width = 64;                  // of the network's layers; a multiple of 16
  std::vector<Level> levels;       // 1 to kMaxHexPlaneLevels

  bool operator==(const HexPlaneShape&) const = default;
  // Returns an empty string, or what is wrong with the shape.
  const char* Complaint() const;

  int Samples(int level, int axis) const {
    return axis == kTimeAxis ? levels[level].time : levels[level].space;
  }
  // Inputs of the network.
  int Inputs() const { return static_cast<int>(levels.size()) * features; }
  size_t PlaneFloats(int level, int plane) const;
  // Position of a plane among all planes' floats.
  size_t PlaneBegin(int level, int plane) const;
  size_t PlaneFloats() const { return PlaneBegin(static_cast<int>(levels.size()), 0); }

  // Positions of the layers among the network's floats: weights of layer k (input by output), then
  // its biases. Layers: Inputs() to width, width to 3 width (one part a head), 3 width to
  // kOffsetStride.
  int LayerInputs(int layer) const {
    return layer == 0 ? Inputs() : layer == 1 ? width : 3 * width;
  }
  int LayerOutputs(int layer) const {
    return layer == 0 ? width : layer == 1 ? kOffsetHeads * width : kOffsetStride;
  }
  size_t WeightsBegin(int layer) const;
  size_t BiasBegin(int layer) const;
  size_t NetworkFloats() const { return WeightsBegin(3); }

  // Returns t from -1 at begin_s to 1 at end_s; times outside are clamped.
  float UnitTime(double time_s) const;
};

struct HexPlaneField {
  HexPlaneShape shape;
  // Level after level, plane after plane; samples of the second axis, then of the first, then
  // features.
  std::vector<float> planes;
  std::vector<float> network;

  bool empty() const { return network.empty(); }
};

}  // namespace color3d
