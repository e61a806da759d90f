#include "core/report/curves.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

class MemoryCheckpoints : public CheckpointStore {
 public:
  std::optional<std::string> Load() override { return saved_; }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override { saved_ = state; }

 private:
  std::optional<std::string> saved_;
};

TEST(CurvesTest, ReadsWrittenCsv) {
  const std::vector<CurvePoint> points{{"geometry", 0.1, 10, "train_l1_l", 1e-7},
                                       {"geometry", 12.75, 1000000, "heldout_psnr_l_db", 22.5}};
  const auto back = CurvesFromCsv(CurvesToCsv(points));
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(back[0].value, 1e-7);
  EXPECT_EQ(back[1].iteration, 1000000);
  EXPECT_EQ(back[1].error_name, "heldout_psnr_l_db");
  EXPECT_THROW(CurvesFromCsv("a,b,c\n"), Error);
  EXPECT_THROW(CurvesFromCsv("a,x,1,e,2\n"), Error);
}

TEST(CurveRecorderTest, ResumesPointsAndClock) {
  MemoryCheckpoints checkpoints;
  NullObserver outer;
  {
    CurveRecorder first("stage", outer, checkpoints);
    EXPECT_FALSE(first.Load().has_value());
    first.OnError(1, "error", 3.0);
    first.OnError(2, "error", std::numeric_limits<double>::quiet_NaN());  // not recorded
    first.Save("trainer state");
  }
  CurveRecorder second("stage", outer, checkpoints);
  EXPECT_EQ(second.Load().value(), "trainer state");
  second.OnError(3, "error", 2.0);
  const auto points = second.points();
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].iteration, 1);
  EXPECT_EQ(points[1].iteration, 3);
  EXPECT_GE(points[1].seconds, points[0].seconds);
}

TEST(CurveRecorderTest, ResumesStatesInFiles) {
  MemoryCheckpoints checkpoints;
  NullObserver outer;
  const ScratchFolder scratch;
  const auto file = scratch.path() / "state";
  for (const std::string& state : {std::string("the state of a stage"), std::string()}) {
    {
      CurveRecorder first("stage", outer, checkpoints);
      first.OnError(1, "error", 3.0);
      WriteFileAtomic(file, state);
      first.SaveFile(file);
      EXPECT_FALSE(std::filesystem::exists(file));
    }
    CurveRecorder second("stage", outer, checkpoints);
    ASSERT_TRUE(second.LoadTo(file));
    EXPECT_EQ(ReadFile(file), state);
    ASSERT_EQ(second.points().size(), 1u);
    EXPECT_EQ(second.points()[0].value, 3.0);
  }
  checkpoints.Save(std::string(40, '\x7f'));
  CurveRecorder damaged("stage", outer, checkpoints);
  EXPECT_THROW(damaged.LoadTo(file), Error);
  MemoryCheckpoints none;
  CurveRecorder fresh("stage", outer, none);
  EXPECT_FALSE(fresh.LoadTo(file));
}

TEST(CurveRecorderTest, RefusesDamagedCheckpoint) {
  MemoryCheckpoints checkpoints;
  NullObserver outer;
  checkpoints.Save(std::string(16, '\xff'));
  CurveRecorder recorder("stage", outer, checkpoints);
  EXPECT_THROW(recorder.Load(), Error);
}

}  // namespace
}  // namespace color3d
