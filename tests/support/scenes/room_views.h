// Cameras in the procedural room and their pictures, sample by sample. Pure functions.
#pragma once

#include <optional>

#include "core/base/image.h"
#include "core/scene/scene.h"
#include "tests/support/scenes/room.h"

namespace color3d {

// Hand-held camera on an arc in front of the table, `t` from -1 (left) to 1 (right). Its height and
// distance vary smoothly. Without names.
View ArcView(double t, int width, int height);

// World direction through a pixel position, of length 1 along the camera's z, so that distances in
// its units are depths.
Eigen::Vector3d RayDirection(const View& view, double x_px, double y_px);

// Projection of the point, px, ignoring occlusion; nullopt if outside the picture.
std::optional<Eigen::Vector2d> PixelOf(const View& view, const Eigen::Vector3d& point);

// Returns true if the point is inside the picture and the room does not occlude it.
bool Sees(const Room& room, const View& view, const Eigen::Vector3d& point);

// One of the side x side samples of a pixel.
struct PixelSample {
  int index = 0;  // 0 .. side^2 - 1, row by row
  int side = 1;
  double x() const { return (index % side + 0.5) / side; }
  double y() const { return (index / side + 0.5) / side; }
  // Size of the sample on a surface at this distance, m.
  double Footprint(const View& view, const Eigen::Vector3d& direction, double distance) const {
    return distance * direction.norm() / (view.camera.fx * side);
  }
};

struct RoomSample {
  Eigen::Vector3d color = Eigen::Vector3d::Zero();  // linear RGB, 0..1
  double depth = 0.0;                               // along the camera's z axis, m
};

RoomSample SampleRoom(const Room& room, const View& view, int x, int y, const PixelSample& sample);

// Stores linear RGB as sRGB 0..1 in a picture of 3 channels.
void SetPixel(const Eigen::Vector3d& linear, int y, int x, Image* picture);

}  // namespace color3d
