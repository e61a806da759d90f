#include "core/stage/sources/seen_samples.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/base/files.h"
#include "core/image/codec.h"
#include "tests/support/scenes/noise_place.h"

namespace color3d {
namespace {

constexpr int kWidth = 176, kHeight = 132, kStepPx = 4;

class SeenByFlowTest : public testing::Test {
 protected:
  // A camera that moves to the right, past these places.
  void AddShot(const std::vector<int>& places) {
    for (size_t i = 0; i < places.size(); ++i) {
      View view;
      view.name = view.image_file = fmt::format("f{:03}.png", scene_.views.size());
      view.camera =
          view.captured_camera = {kWidth, kHeight, 180.0, 180.0, kWidth / 2.0, kHeight / 2.0};
      view.moment = Moment{0.04 * static_cast<double>(scene_.views.size()), shots_};
      WriteFileAtomic(scratch_.path() / view.image_file,
                      EncodePng8(NoisePlace(places[i], kWidth, kHeight, kStepPx * static_cast<int>(i))));
      scene_.views.push_back(view);
    }
    ++shots_;
  }
  SeenSamples Seen(const std::vector<int>& views) {
    const ViewImages images(scene_, scratch_.path(), kWidth);
    return SeenByFlow(scene_, views, images, grid_, pool_, {});
  }
  double Share(const SeenSamples& seen, int by, int view) const {
    int shown = 0;
    for (int s = 0; s < seen.samples(); ++s) shown += seen.IsSeen(by, view, s) ? 1 : 0;
    return static_cast<double>(shown) / seen.samples();
  }

  ScratchFolder scratch_;
  Scene scene_;
  SampleGrid grid_{16, 12};
  ThreadPool pool_{2};
  int shots_ = 0;
};

TEST_F(SeenByFlowTest, FollowsPlacesWhileTheyAreInThePicture) {
  AddShot({1, 1, 1, 1, 1, 1, 1, 1});
  const SeenSamples seen = Seen({0, 3, 7});
  EXPECT_EQ(Share(seen, 1, 1), 1.0);
  // Share of a frame that is still in the picture after 4, 7 and 3 steps to the right.
  EXPECT_NEAR(Share(seen, 2, 1), 1.0 - 4.0 * kStepPx / kWidth, 0.07);
  EXPECT_NEAR(Share(seen, 2, 0), 1.0 - 7.0 * kStepPx / kWidth, 0.07);
  EXPECT_NEAR(Share(seen, 0, 1), 1.0 - 3.0 * kStepPx / kWidth, 0.07);
  // What leaves on the left is lost: samples of the first column are not seen by later frames.
  EXPECT_FALSE(seen.IsSeen(2, 0, 0));
  EXPECT_TRUE(seen.IsSeen(2, 0, 8));
}

TEST_F(SeenByFlowTest, StopsAtCutsAndAtOtherPictures) {
  AddShot({1, 1, 1, 2, 2, 2});  // one shot, though the place changes
  AddShot({1, 1, 1});
  const SeenSamples seen = Seen({0, 2, 4, 7});
  EXPECT_GT(Share(seen, 0, 1), 0.85);
  EXPECT_LT(Share(seen, 0, 2), 0.15);
  EXPECT_EQ(Share(seen, 0, 3), 0.0);
  EXPECT_EQ(Share(seen, 3, 2), 0.0);
}

}  // namespace
}  // namespace color3d
