// Cameras in the procedural room and their pictures, sample by sample. Pure functions.
#pragma once

#include <optional>

#include "core/base/image.h"
#include "core/scene/scene.h"
#include "tests/support/scenes/room.h"

namespace color3d {

// A camera on an arc in front of the table: `t` from -1, left, to 1, right; carried by hand, so
// that its height and distance vary smoothly on the way. Without names.
View ArcView(double t, int width, int height);

// Direction through a pixel position in the world's axes, of length 1 along the camera's z: a
// distance in its lengths is a depth.
Eigen::Vector3d RayDirection(const View& view, double x_px, double y_px);

// Where the picture shows the point, px, if nothing hides it; nothing when it lies outside.
std::optional<Eigen::Vector2d> PixelOf(const View& view, const Eigen::Vector3d& point);

// True when the view's picture contains the point and the room does not hide it.
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

// Linear RGB as sRGB 0..1 into a picture of 3 channels.
void SetPixel(const Eigen::Vector3d& linear, int y, int x, Image* picture);

}  // namespace color3d
