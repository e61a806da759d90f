// Instruction set of the numeric kernels. The kernels are compiled once per set (Highway's
// foreach_target) and selected at run time: the best set of the machine, unless the environment
// variable COLOR3D_ISA names a lesser one (portable, sse4, avx2, avx512; neon). Thread-safe, but a
// change during training changes the last digits of its results.
#pragma once

// Compiled: a fallback for any machine, SSE4, AVX2 and AVX-512, or NEON. The vector types are
// members of structs, so the sets without a size at compile time are left out; the others would
// only cost compile time. GCC before 12.3 miscompiles the fallback's high halves of products (GCC
// bug 106322), which nothing here uses. Must come before Highway's headers.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SCALAR)
#define HWY_BROKEN_EMU128 0

#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// The set in use: "portable", "sse4", "avx2", "avx512" or "neon". Throws Error{kInvalidArgument} if
// COLOR3D_ISA names a set that this machine does not support.
std::string_view ActiveInstructionSet();

// Sets that this machine supports, best first.
std::vector<std::string> SupportedInstructionSets();

// Selects `name` from now on, or the best set if it is empty. Throws Error{kInvalidArgument} if
// this machine does not support it.
void LimitInstructionSet(std::string_view name);

// Reads COLOR3D_ISA at the first call; every kernel is entered through it.
void ApplyInstructionSetLimit();

}  // namespace color3d

// The selected set's version of a function named in HWY_EXPORT.
#define COLOR3D_KERNEL(FUNCTION) \
  (::color3d::ApplyInstructionSetLimit(), HWY_DYNAMIC_DISPATCH(FUNCTION))
