#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/stage/run_stages.h"

namespace color3d {
namespace {

TEST(RenderOptionsTest, ChecksRanges) {
  RenderOptions options;
  options.Validate();
  options.max_views = 0;
  EXPECT_THROW(options.Validate(), Error);
  options.max_views = 1;
  options.max_side_px = 1'000'000;
  EXPECT_THROW(options.Validate(), Error);
}

}  // namespace
}  // namespace color3d
