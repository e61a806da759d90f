// Ray caster of a furnished room of boxes and ellipsoids, lit by one area lamp. World: metres, x
// right, y down, z into the room. Immutable, thread-safe.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tests/support/scenes/solid.h"

namespace color3d {

class Room {
 public:
  // The seed moves the furniture slightly and changes all noise.
  explicit Room(uint64_t seed);

  // Nearest surface in front of `origin`, which lies inside the room.
  Hit Trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  // Linear RGB, 0..1, of a surface point, equal from all directions (no gloss). `lamp_u`, `lamp_v`
  // in 0..1 select the point of the lamp; averaging over them gives soft shadows.
  Eigen::Vector3d Radiance(const Hit& hit,
                           const Eigen::Vector3d& position,
                           double footprint_m,
                           double lamp_u,
                           double lamp_v) const;

 private:
  void AddShell();
  void AddPictures();
  void AddFurniture(uint64_t seed);
  bool IsLit(const Eigen::Vector3d& position, const Eigen::Vector3d& lamp) const;
  double CornerShade(const Eigen::Vector3d& position) const;
  double ContactShade(const Hit& hit, const Eigen::Vector3d& position) const;

  uint32_t seed_;
  std::vector<Solid> objects_;  // the first is the room itself
};

}  // namespace color3d
