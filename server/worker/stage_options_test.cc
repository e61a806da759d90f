#include "server/worker/stage_options.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

using Precision = ColorizerOptions::Precision;

TEST(ColorizerOptionsFromTest, UnsetFieldsKeepTheMethodsDefaults) {
  const ColorizerOptions defaults;
  const ColorizerOptions options = ColorizerOptionsFrom(v1::PersonalizeSpec(), 17);
  EXPECT_EQ(options.seed, 17u);
  EXPECT_EQ(options.precision, Precision::kAuto);
  EXPECT_EQ(options.average_decay, defaults.average_decay);
  EXPECT_EQ(options.average_decay, 0.99) << "as stage.proto says";
  EXPECT_EQ(options.least_improvement, defaults.least_improvement);
}

TEST(ColorizerOptionsFromTest, WhatIsSetArrives) {
  v1::PersonalizeSpec spec;
  spec.set_precision(v1::PersonalizeSpec::PRECISION_FLOAT32);
  spec.set_average_decay(0.0);
  spec.set_least_improvement(0.02);
  ColorizerOptions options = ColorizerOptionsFrom(spec, 1);
  EXPECT_EQ(options.precision, Precision::kFloat32);
  EXPECT_EQ(options.average_decay, 0.0);
  EXPECT_EQ(options.least_improvement, 0.02);
  spec.set_precision(v1::PersonalizeSpec::PRECISION_BFLOAT16);
  EXPECT_EQ(ColorizerOptionsFrom(spec, 1).precision, Precision::kBfloat16);
  spec.set_precision(v1::PersonalizeSpec::PRECISION_AUTO);
  EXPECT_EQ(ColorizerOptionsFrom(spec, 1).precision, Precision::kAuto);
}

// What the server lets through, the method takes.
TEST(ColorizerOptionsFromTest, EndsOfTheDocumentedRangesAreValid) {
  v1::PersonalizeSpec spec;
  spec.set_average_decay(0.9999);
  spec.set_least_improvement(0.5);
  EXPECT_NO_THROW(ColorizerOptionsFrom(spec, 1).Validate());
}

}  // namespace
}  // namespace color3d
