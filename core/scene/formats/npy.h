// NumPy's files of numbers (format 1 and 2). For this folder only.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

struct NpyArray {
  std::vector<size_t> shape;
  std::vector<double> values;  // in C order, all finite
};

// float32, float64, and int32, int64, little-endian, C or Fortran order, of at most `max_values`.
// Throws Error{kInvalidArgument} that names the file: not such a file, cut short, other types,
// numbers that are not finite.
NpyArray ReadNpy(std::string_view bytes, const std::string& file_name, size_t max_values);

}  // namespace color3d
