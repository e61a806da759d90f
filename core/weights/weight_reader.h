// Hands the arrays of a weight file to a network, by name and with the shape that the network
// expects, and in the end tells everything that does not fit in one message. Not thread-safe.
//
// How a network's constructor uses it: take the WeightMap by value, move it in, Take() every array
// (each leaves the map, so no second copy of the model is ever held: hand `values` over to the
// tensor, see core/encoder/weight_tensors.h), Ignore() what the format carries and the network does
// not need, Finish().
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
  // The stored shape, empty when there is no such array: for reading sizes before Take().
  std::vector<int64_t> ShapeOf(const std::string& name) const;

  // Moves the array out. When it is missing, misshapen or holds a value that is not finite, that is
  // remembered for Finish() and zeros of the expected shape are returned. Throws what Finish()
  // throws at once when the zeros would need more memory than the file itself (plus 64 MB): then it
  // is not this network's file at all.
  WeightArray Take(const std::string& name, const std::vector<int64_t>& shape);

  // Drops the arrays whose names end in `suffix` or (IgnorePrefix) start with `prefix`.
  void Ignore(std::string_view suffix);
  void IgnorePrefix(std::string_view prefix);

  // Throws Error{kInvalidArgument} with the missing, misshapen, unexpected (never taken nor
  // ignored) and non-finite arrays: the counts, and the first ten names of each with shapes.
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

// "[96,3,4,4]".
std::string ShapeText(const std::vector<int64_t>& shape);

}  // namespace color3d
