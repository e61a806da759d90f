// Stiff and extreme cases of all parts of the method (METHOD.md "Stability"), each run through the
// real kernels and compared with float64. Used by stability_test and by color3d-bench stability.
//
// Errors are relative, per buffer: max |fast - reference| / max |reference|. Buffers of values are
// the colour channels, opacity and depth; buffers of gradients are the rows of parameters, where
//  - rotation gradients are multiplied by the quaternion's norm (they scale with its inverse),
//  - the denominator is at least 1e-3 of the largest gradient in the row's group, because a row may
//    vanish by symmetry (turning a sphere changes nothing); rotation and log scale are one group.
// Pixels where rounding decides on which side of a threshold a number falls (alpha 1/255 and 0.99,
// transmittance 1e-4) have two right answers: they are left out of both sides, values and
// gradients, and counted.
//
// Bounds are about eps * condition where the condition number is too large for float32.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

inline constexpr double kNotCompared = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kFloatEpsilon = std::numeric_limits<float>::epsilon();

struct StabilityResult {
  double condition = 1.0;
  std::string condition_of;  // quantity with that condition number
  double value_error = kNotCompared;
  double value_bound = 0.0;
  double gradient_error = kNotCompared;
  double gradient_bound = 0.0;
  int64_t non_finite = 0;
  int64_t compared = 0;  // pixels or numbers
  int64_t left_out = 0;  // near a threshold
  int64_t restores = 0;  // of the last good state, according to the curves
  bool held = true;      // other requirements of the case
  std::string outcome;   // in words, for cases other than comparisons
  double seconds = 0.0;

  bool Passed() const;
};

struct StabilityCase {
  std::string group;  // e.g. "raster"
  std::string name;   // unique in the group
  bool slow = false;  // for the benchmark only
  std::function<StabilityResult(ThreadPool&)> run;
};

// In the order of the table.
std::vector<StabilityCase> StabilityCases();

// Runs a case and measures its time. An unexpected exception gives a failed result.
StabilityResult RunStabilityCase(const StabilityCase& stability_case, ThreadPool& pool);

int64_t CountNonFinite(const float* values, size_t count);

// Groups of StabilityCases.
void AddRasterCases(std::vector<StabilityCase>& cases);
void AddLossCases(std::vector<StabilityCase>& cases);
void AddAdamCases(std::vector<StabilityCase>& cases);
void AddGeometryCases(std::vector<StabilityCase>& cases);
void AddMotionCases(std::vector<StabilityCase>& cases);
void AddChromaCases(std::vector<StabilityCase>& cases);
void AddMatchingCases(std::vector<StabilityCase>& cases);
void AddColorizerCases(std::vector<StabilityCase>& cases);
void AddGridCases(std::vector<StabilityCase>& cases);
void AddCarryCases(std::vector<StabilityCase>& cases);
void AddSoftmaxCases(std::vector<StabilityCase>& cases);
void AddColorCases(std::vector<StabilityCase>& cases);
void AddFilmCases(std::vector<StabilityCase>& cases);
void AddFormatCases(std::vector<StabilityCase>& cases);
void AddPoseCases(std::vector<StabilityCase>& cases);

}  // namespace color3d
