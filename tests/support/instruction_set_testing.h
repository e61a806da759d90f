// Parameters for tests that run once per instruction set of the machine.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "core/simd/instruction_set.h"

namespace color3d {

// The parameter is (case, instruction set); instantiate with
// testing::Combine(cases, EachInstructionSet()).
template <class Case>
class InstructionSetTest : public testing::TestWithParam<std::tuple<Case, std::string>> {
 protected:
  void SetUp() override {
    LimitInstructionSet(std::get<1>(this->GetParam()));
    ASSERT_EQ(ActiveInstructionSet(), std::get<1>(this->GetParam()));
  }
  void TearDown() override { LimitInstructionSet(""); }
  const Case& TestCase() const { return std::get<0>(this->GetParam()); }
};

inline auto EachInstructionSet() { return testing::ValuesIn(SupportedInstructionSets()); }

}  // namespace color3d
