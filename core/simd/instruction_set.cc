#include "core/simd/instruction_set.h"

#include <cstdint>
#include <cstdlib>

#include "core/base/error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/simd/instruction_set.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

int64_t CompiledTarget() { return HWY_TARGET; }

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {

HWY_EXPORT(CompiledTarget);

const char* NameOf(int64_t target) {
  switch (target) {
#if HWY_ARCH_X86
    case HWY_AVX3:
      return "avx512";
    case HWY_AVX2:
      return "avx2";
    case HWY_SSE4:
      return "sse4";
#elif HWY_ARCH_ARM
    case HWY_NEON:
      return "neon";
#endif
    default:
      return "portable";
  }
}

void Choose(std::string_view name) {
  std::string known;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    if (name.empty() || name == NameOf(target)) {
      hwy::GetChosenTarget().Update(target);
      return;
    }
    known += (known.empty() ? "" : ", ") + std::string(NameOf(target));
  }
  throw InvalidArgument(
      "the instruction set '{}' (COLOR3D_ISA) is not available on this machine; use one of {}",
      name,
      known);
}

}  // namespace

std::string_view ActiveInstructionSet() { return NameOf(COLOR3D_KERNEL(CompiledTarget)()); }

std::vector<std::string> SupportedInstructionSets() {
  std::vector<std::string> names;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) names.push_back(NameOf(target));
  return names;
}

void ApplyInstructionSetLimit() {
  static const bool applied = [] {
    const char* name = std::getenv("COLOR3D_ISA");
    Choose(name == nullptr ? "" : name);
    return true;
  }();
  static_cast<void>(applied);
}

void LimitInstructionSet(std::string_view name) {
  ApplyInstructionSetLimit();  // so that the environment cannot overrule this at the first kernel
  Choose(name);
}

}  // namespace color3d
#endif  // HWY_ONCE
