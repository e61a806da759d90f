#include "core/scene/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

FrameTime Frame(const std::string& file,
                std::optional<double> time,
                const std::string& camera = "") {
  return {"frame " + file.substr(0, 3), file, time, camera};
}

TEST(FrameTimes, OrdersFramesOfOneCamera) {
  const FrameMoments m = AssignMoments(
      {Frame("images/c.png", 0.5), Frame("images/a.png", -0.5), Frame("images/b.png", 0)});
  EXPECT_EQ(m.moments[0], (Moment{1.0, 0}));
  EXPECT_EQ(m.moments[1], (Moment{0.0, 0}));
  EXPECT_EQ(m.moments[2], (Moment{0.5, 0}));
  EXPECT_EQ(m.cameras.size(), 1u);
  // Folders are no cameras if no two frames share a time.
  EXPECT_EQ(AssignMoments({Frame("a/1.png", 0), Frame("b/2.png", 1)}).cameras.size(), 1u);
}

TEST(FrameTimes, FoldersAreCamerasIfFramesShareTime) {
  const FrameMoments m =
      AssignMoments({Frame("images/cam02/1.png", 3),
                     Frame("images/cam01/1.png", 3),
                     Frame("images/cam01/2.png", 3.04),
                     Frame("images/cam02/2.png", 3.04),
                     Frame("images/cam02/3.png", 3.08)});  // films of other lengths
  EXPECT_EQ(m.cameras, (std::vector<std::string>{"cam01", "cam02"}));
  EXPECT_EQ(m.moments[0], (Moment{0.0, 1}));
  EXPECT_EQ(m.moments[1], (Moment{0.0, 0}));
  EXPECT_EQ(m.moments[2]->time_s, m.moments[3]->time_s);
  EXPECT_EQ(m.moments[4]->shot, 1);
}

TEST(FrameTimes, NamedCamerasMayShareFolder) {
  const FrameMoments m = AssignMoments({Frame("a.png", 0, "right"),
                                        Frame("b.png", 0, "left"),
                                        Frame("c.png", 1, "right"),
                                        Frame("d.png", 1, "left")});
  EXPECT_EQ(m.cameras, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(m.moments[2], (Moment{1.0, 1}));
}

TEST(FrameTimes, MergesTimesThatDifferByRounding) {
  const FrameMoments m = AssignMoments({Frame("a/1.png", 0.1 * 3),
                                        Frame("b/1.png", 0.3),
                                        Frame("a/0.png", 0),
                                        Frame("b/0.png", 0),
                                        Frame("a/2.png", 0.4)});
  EXPECT_EQ(m.moments[0]->time_s, m.moments[1]->time_s);
  EXPECT_EQ(m.moments[4]->time_s, 0.4);
}

// Times of frames at 29.97 fps, rounded to the ticks of a container.
std::vector<FrameTime> Rounded(const std::string& camera, int ticks, double offset_s, int count) {
  std::vector<FrameTime> frames;
  for (int i = 0; i < count; ++i) {
    const double time = i * 1001 / 30000.0 + offset_s;
    frames.push_back(Frame(camera + std::to_string(i), std::round(time * ticks) / ticks, camera));
  }
  return frames;
}

TEST(FrameTimes, CamerasShareMomentsDespiteRounding) {
  constexpr int kCount = 900;  // rounded steps of 1/600 s drift by 15 ticks
  std::vector<FrameTime> frames = Rounded("a", 600, 0.0, kCount);
  for (const FrameTime& frame : Rounded("b", 90000, 0.0, kCount)) frames.push_back(frame);
  const FrameMoments m = AssignMoments(frames);
  for (int i = 0; i < kCount; ++i) {
    ASSERT_EQ(m.moments[i]->time_s, m.moments[kCount + i]->time_s) << i;
    ASSERT_NEAR(m.moments[i]->time_s, i * 1001 / 30000.0, 1.0 / 600) << i;
  }
  EXPECT_EQ(m.note, "");
}

TEST(FrameTimes, NotesOffsetOfFifthOfStep) {
  std::vector<FrameTime> frames = Rounded("a", 90000, 0.0, 40);
  for (const FrameTime& frame : Rounded("b", 90000, 0.0067, 40)) frames.push_back(frame);
  const FrameMoments m = AssignMoments(frames);
  for (int i = 0; i < 40; ++i) EXPECT_EQ(m.moments[i]->time_s, m.moments[40 + i]->time_s) << i;
  EXPECT_THAT(m.note, HasSubstr("clocks differ by up to 0.0067"));
}

TEST(FrameTimes, KeepsTimesOfUnsynchronizedCameras) {
  std::vector<FrameTime> halves = Rounded("a", 90000, 0.0, 40);
  for (const FrameTime& frame : Rounded("b", 90000, 0.0167, 40)) halves.push_back(frame);
  const FrameMoments m = AssignMoments(halves);
  EXPECT_NEAR(m.moments[40]->time_s, 0.0167, 1e-4);
  EXPECT_EQ(m.note, "");
  const FrameMoments rates = AssignMoments({Frame("a0", 0.0, "a"),
                                            Frame("a1", 0.1, "a"),
                                            Frame("a2", 0.2, "a"),
                                            Frame("b0", 0.0, "b"),
                                            Frame("b1", 0.06, "b"),
                                            Frame("b2", 0.12, "b")});
  EXPECT_EQ(rates.moments[4]->time_s, 0.06);
}

TEST(FrameTimes, OneTimeMakesStaticScene) {
  const FrameMoments m = AssignMoments({Frame("a.png", 7), Frame("b.png", 7)});
  EXPECT_FALSE(m.moments[0] || m.moments[1]);
  EXPECT_THAT(m.note, HasSubstr("all 2 frames were taken at one time"));
  EXPECT_TRUE(m.cameras.empty());
  const FrameMoments none = AssignMoments({Frame("a.png", {}), Frame("b.png", {})});
  EXPECT_FALSE(none.moments[0]);
  EXPECT_EQ(none.note, "");
  EXPECT_TRUE(AssignMoments({}).moments.empty());
}

std::string Said(const std::vector<FrameTime>& frames) {
  return Refusal([&] { AssignMoments(frames); });
}

TEST(FrameTimes, NamesContradictions) {
  EXPECT_THAT(Said({Frame("a.png", 0), Frame("b.png", {}), Frame("c.png", 1)}),
              HasSubstr("frame b.p (b.png) has no time, but frame a.p has one"));
  EXPECT_THAT(Said({Frame("a.png", {}), Frame("b.png", 0)}), HasSubstr("(a.png) has no time"));
  EXPECT_THAT(Said({Frame("a.png", 0, "x"), Frame("b.png", 1)}),
              HasSubstr("(b.png) has no camera"));
  const std::string flat = Said({Frame("a.png", 0), Frame("b.png", 0), Frame("c.png", 1)});
  EXPECT_THAT(flat, HasSubstr("(a.png) and frame b.p (b.png) are of one camera and one time (0)"));
  EXPECT_THAT(flat, HasSubstr("each camera a folder"));
  EXPECT_THAT(Said({Frame("a.png", 2, "x"), Frame("b.png", 2, "x"), Frame("c.png", 1, "x")}),
              HasSubstr("of one camera (x) and one time (2)"));
  const double huge = std::numeric_limits<double>::max();
  EXPECT_THAT(Said({Frame("a.png", -huge), Frame("b.png", huge)}), HasSubstr("too far apart"));
}

}  // namespace
}  // namespace color3d
