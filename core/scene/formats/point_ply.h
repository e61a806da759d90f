// Reads point clouds from PLY files, as initial geometry. For core/scene only.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// Reads x, y and z of the vertices of a PLY: ascii, binary_little_endian or binary_big_endian,
// numbers of any type, other properties ignored. Points that are not finite are left out; if there
// are more than `most`, every n-th is kept. Throws Error{kInvalidArgument} that names the file if
// it is no PLY, has no vertices with x, y and z, is truncated, or has lists in its vertices.
std::vector<Eigen::Vector3d> ReadPointPly(std::string_view bytes,
                                          const std::string& file_name,
                                          size_t most);

}  // namespace color3d
