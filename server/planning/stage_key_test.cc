#include "server/planning/stage_key.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(StageKey, DependsOnOptionsAndSeedOnly) {
  v1::JobSpec spec;
  spec.set_scene("scenes/a");
  spec.mutable_reconstruct_geometry()->set_iterations(10);
  const std::string key = KeyPartOf(spec).bytes;
  v1::JobSpec other = spec;
  other.set_scene("scenes/b");
  other.add_inputs("jobs/x");
  other.set_skip_cache(true);
  EXPECT_EQ(KeyPartOf(other).bytes, key);
  other.mutable_reconstruct_geometry()->set_iterations(11);
  EXPECT_NE(KeyPartOf(other).bytes, key);
  other = spec;
  other.set_seed(2);
  EXPECT_NE(KeyPartOf(other).bytes, key);
  v1::JobSpec report;
  report.mutable_colorize_scene();
  EXPECT_EQ(KeyPartOf(report).bytes, "") << "reports are never cached";
}

}  // namespace
}  // namespace color3d
