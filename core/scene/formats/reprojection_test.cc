#include "core/scene/formats/reprojection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace color3d {
namespace {

using ::testing::IsEmpty;

// What all cameras have alike is judged by itself, and few observations are no evidence.
TEST(Reprojection, WarnsOfLargeErrorsAndOutlierCameras) {
  // The same error in pixels where all cameras have it.
  CameraReprojection camera{1, {"a.png"}, 100, 1.6, 1.5};
  EXPECT_THAT(ReprojectionWarnings({camera, camera}), IsEmpty());
  camera.median_px = 2.1;
  EXPECT_EQ(ReprojectionWarnings({camera, camera}).size(), 2u);
  camera.observations = 3;
  EXPECT_THAT(ReprojectionWarnings({camera}), IsEmpty());
}

}  // namespace
}  // namespace color3d
