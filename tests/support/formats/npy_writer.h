// Writer of NumPy files (np.save).
#pragma once

#include <cstring>
#include <string>
#include <vector>

namespace color3d {

// float64, C order.
inline std::string NpyOf(const std::vector<size_t>& shape, const std::vector<double>& values) {
  std::string sides;
  for (const size_t side : shape) sides += std::to_string(side) + ", ";
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (" + sides + "), }";
  header.resize((10 + header.size() + 64) / 64 * 64 - 11, ' ');
  header += '\n';
  std::string bytes = std::string("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 255);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), 8 * values.size());
  return bytes;
}

}  // namespace color3d
