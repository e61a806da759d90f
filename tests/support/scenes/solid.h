// A body of synthetic scenes: a box, an ellipsoid, a waving sheet or the surrounding room, with ray
// intersection and material. A plain value.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tests/support/scenes/room_materials.h"

namespace color3d {

struct Hit {
  double distance = 0.0;  // along the ray, in lengths of its direction; < 0: nothing
  int object = -1;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // towards the viewer
};

// World: metres, y down. A solid's own axes are the world's, turned about y by its yaw.
struct Solid {
  // kRoom: a box seen from inside. kSheet: the surface z = half.z sin(2 pi x / wave_m - phase) over
  // |x| <= half.x, |y| <= half.y of its own axes, painted on both sides; its points move along z.
  enum class Shape { kRoom, kBox, kEllipsoid, kSheet };
  Shape shape = Shape::kBox;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Ones();  // half sizes, or radii
  double cos_yaw = 1.0;
  double sin_yaw = 0.0;
  double wave_m = 1.0;  // of a sheet, > 0
  double phase = 0.0;
  double squared_radius = 3.0;      // of the sphere around it, m^2
  std::vector<Material> materials;  // one, or six: -x +x -y +y -z +z

  Solid() = default;
  Solid(Shape its_shape,
        const Eigen::Vector3d& its_center,
        const Eigen::Vector3d& its_half,
        double yaw_degrees,
        const Material& material);
  void SetYaw(double degrees);

  // Rotates a direction from world axes to own axes, and back.
  Eigen::Vector3d ToLocal(const Eigen::Vector3d& v) const;
  Eigen::Vector3d ToWorld(const Eigen::Vector3d& v) const;
  // Maps a surface point to coordinates of the material, which neither moves nor waves, and back.
  Eigen::Vector3d OnMaterial(const Eigen::Vector3d& world) const;
  Eigen::Vector3d InWorld(const Eigen::Vector3d& on_material) const;

  // Fast test: true if the ray misses the solid.
  bool Misses(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // First intersection ahead. Returns false and leaves `hit` if there is none. Does not set the
  // object.
  bool Intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, Hit* hit) const;
  // Approximate distance to the surface, m; negative inside. Not for sheets.
  double Clearance(const Eigen::Vector3d& position) const;
  // Albedo of a surface point, linear RGB in 0..1.
  Eigen::Vector3d AlbedoAt(const Eigen::Vector3d& normal,
                           const Eigen::Vector3d& position,
                           double footprint_m,
                           uint32_t seed) const;

 private:
  bool IntersectEllipsoid(const Eigen::Vector3d& o, const Eigen::Vector3d& d, Hit* hit) const;
  bool IntersectSheet(const Eigen::Vector3d& o,
                      const Eigen::Vector3d& d,
                      double t_in,
                      double t_out,
                      Hit* hit) const;
  double Height(double x) const;
};

}  // namespace color3d
