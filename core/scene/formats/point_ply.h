// Clouds of points in PLY files, as the start of geometry. For core/scene only.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// x, y and z of the vertices of a PLY: ascii, binary_little_endian or binary_big_endian, numbers of
// any type, with whatever other properties. Points that are not finite are left out; of more than
// `most` every so manieth is kept. Throws Error{kInvalidArgument} that names the file: no PLY, no
// vertices with x, y and z, cut short, lists in its vertices.
std::vector<Eigen::Vector3d> ReadPointPly(std::string_view bytes,
                                          const std::string& file_name,
                                          size_t most);

}  // namespace color3d
