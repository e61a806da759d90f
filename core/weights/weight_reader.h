// Moves the arrays of a weight file into a network, by name and expected shape, and reports all
// mismatches in one message. Not thread-safe.
//
// Usage in the constructor of a network: accept the WeightMap by value and move it in; Take() every
// array (each leaves the map, which avoids a second copy of the model; move `values` into the
// tensor, see core/encoder/weight_tensors.h); Ignore() arrays that the network does not need;
// Finish().
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/weights/weight_map.h"

namespace color3d {

class WeightReader {
 public:
  // `what` starts the message: "the DDColor weights".
  WeightReader(WeightMap weights, std::string what);

  bool Has(const std::string& name) const { return weights_.count(name) > 0; }
  // Returns the stored shape, empty if there is no such array. For sizes that are needed before
  // Take().
  std::vector<int64_t> ShapeOf(const std::string& name) const;

  // Moves the array out. If it is missing, misshapen or not finite, records this for Finish() and
  // returns zeros of the expected shape. Throws the error of Finish() at once if the zeros would
  // take more memory than the file plus 64 MB, since the file is then of another network.
  WeightArray Take(const std::string& name, const std::vector<int64_t>& shape);

  // Drops the arrays whose names end in `suffix` or (IgnorePrefix) start with `prefix`.
  void Ignore(std::string_view suffix);
  void IgnorePrefix(std::string_view prefix);

  // Throws Error{kInvalidArgument} with the missing, misshapen, unexpected (neither taken nor
  // ignored) and non-finite arrays: their number, and the first ten names of each with shapes.
  void Finish() const;

 private:
  [[noreturn]] void Report(bool complete) const;
  WeightArray Zeros(const std::vector<int64_t>& shape);

  WeightMap weights_;
  std::string what_;
  int64_t zeros_budget_;
  std::set<std::string> missing_;
  std::vector<std::string> misshapen_;
  std::vector<std::string> not_finite_;
};

// Returns the shape as "[96,3,4,4]".
std::string ShapeText(const std::vector<int64_t>& shape);

}  // namespace color3d
