#include "core/splat/geometry/geometry_state.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(GeometryStateTest, RejectsDamagedBytesOfEveryLength) {
  GeometryState state;
  state.parameters = ParameterBlock(12, 5);
  state.moments = {ParameterBlock(12, 5), ParameterBlock(12, 5)};
  state.statistics.Reset(5);
  state.order.views = {2, 0, 1};
  state.exposures.resize(3);
  state.exposures[1].offset = 0.25;
  const std::string bytes = SerializeGeometryState(state, "a");
  GeometryState read;
  EXPECT_TRUE(ParseGeometryState(bytes, "a", read));
  EXPECT_EQ(read.order.views, state.order.views);
  ASSERT_EQ(read.exposures.size(), 3u);
  EXPECT_EQ(read.exposures[1].offset, 0.25);
  EXPECT_FALSE(ParseGeometryState(bytes, "b", read));
  for (size_t n = 0; n < bytes.size(); n += 7) {
    EXPECT_FALSE(ParseGeometryState(bytes.substr(0, n), "a", read));
  }
}

}  // namespace
}  // namespace color3d
