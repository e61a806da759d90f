#include "core/simd/instruction_set.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

TEST(InstructionSetsTest, DefaultsToBestAndRejectsUnknownNames) {
  LimitInstructionSet("");
  EXPECT_EQ(ActiveInstructionSet(), SupportedInstructionSets().front());
  EXPECT_THROW(LimitInstructionSet("avx1024"), Error);
}

}  // namespace
}  // namespace color3d
