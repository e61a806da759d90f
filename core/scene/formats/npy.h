// Reads NumPy's array files (format 1 and 2). For this folder only.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

struct NpyArray {
  std::vector<size_t> shape;
  std::vector<double> values;  // in C order, all finite
};

// Reads at most `max_values` little-endian values of type float32, float64, int32 or int64 in C or
// Fortran order. Throws Error{kInvalidArgument} that names the file if it is no such file, is
// truncated, has another type, or a number that is not finite.
NpyArray ReadNpy(std::string_view bytes, const std::string& file_name, size_t max_values);

}  // namespace color3d
