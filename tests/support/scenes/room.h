// A furnished room made of boxes and ellipsoids, lit by one area lamp: what a ray sees and how
// bright it is. World: metres, x right, y down, z into the room. Immutable, thread-safe.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/scenes/room_materials.h"

namespace color3d {

struct Hit {
  double distance = 0.0;  // along the ray, in lengths of its direction; < 0: nothing
  int object = -1;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // towards the viewer
};

class Room {
 public:
  // The seed moves the furniture a little and changes all noise.
  explicit Room(uint64_t seed);

  // Nearest surface in front of `origin`, which lies inside the room.
  Hit Trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  // Linear RGB, 0..1, of a surface point, the same from every side (no gloss). `lamp_u`, `lamp_v`
  // in 0..1 pick the point of the lamp; averaging over them gives soft shadows.
  Eigen::Vector3d Radiance(const Hit& hit,
                           const Eigen::Vector3d& position,
                           double footprint_m,
                           double lamp_u,
                           double lamp_v) const;

 private:
  struct Object {
    enum class Shape { kRoom, kBox, kEllipsoid };
    Shape shape = Shape::kBox;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    Eigen::Vector3d half = Eigen::Vector3d::Ones();  // half sizes, or radii
    double cos_yaw = 1.0;
    double sin_yaw = 0.0;
    double squared_radius = 0.0;      // of the sphere around it, m^2
    std::vector<Material> materials;  // one, or six: -x +x -y +y -z +z
  };

  // World to the object's own axes and back (rotation about y only).
  static Eigen::Vector3d ToLocal(const Object& object, const Eigen::Vector3d& v);
  static Eigen::Vector3d ToWorld(const Object& object, const Eigen::Vector3d& v);
  // A quick test that the ray passes the object by.
  static bool Misses(const Object& object,
                     const Eigen::Vector3d& origin,
                     const Eigen::Vector3d& direction);
  static bool Intersect(const Object& object,
                        const Eigen::Vector3d& origin,
                        const Eigen::Vector3d& direction,
                        Hit* hit);
  Object MakeBox(const Eigen::Vector3d& center,
                 const Eigen::Vector3d& half,
                 double yaw_degrees,
                 const Material& material) const;
  void AddShell();
  void AddPictures();
  void AddFurniture(uint64_t seed);
  bool IsLit(const Eigen::Vector3d& position, const Eigen::Vector3d& lamp) const;
  double CornerShade(const Eigen::Vector3d& position) const;
  // About the distance to the object's surface, m; negative inside.
  static double Clearance(const Object& object, const Eigen::Vector3d& position);
  double ContactShade(const Hit& hit, const Eigen::Vector3d& position) const;

  uint32_t seed_;
  std::vector<Object> objects_;  // the first is the room itself
};

}  // namespace color3d
