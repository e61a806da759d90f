#include "core/splat/geometry/warm_up.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/render.h"
#include "tests/support/scenes/splat_scene.h"

namespace color3d {
namespace {

using testing_scene::MakeRoomCorner;
using testing_scene::ProceduralScene;

// Saves at the given call of WantsSave() and cancels; keeps the state.
class SaveThenStop : public CheckpointStore {
 public:
  SaveThenStop(int save_after, CancellationToken* cancel) : left_(save_after), cancel_(cancel) {}
  std::optional<std::string> Load() override { return saved; }
  bool WantsSave() override { return cancel_ != nullptr && --left_ == 0; }
  void Save(const std::string& state) override {
    saved = state;
    cancel_->Cancel();
  }
  std::optional<std::string> saved;

 private:
  int left_;
  CancellationToken* cancel_;
};

class JointTrainingTest : public testing::Test {
 protected:
  JointTrainingTest() : scene_(MakeRoomCorner(5, 64, 48, 400)) {
    options_.recipe = GeometryOptions::Recipe::kPaper;
    options_.iterations = 120;
    options_.max_gaussians = 2000;
    options_.sh_degree = 3;
    options_.warm_up = 0.5;
    // The recipe's times are of thousands of iterations.
    options_.tuning = TuningOf(options_);
    options_.tuning->densify_from = 0.1;
    options_.tuning->densify_until = 0.8;
    options_.tuning->densify_rounds = 6;
    options_.tuning->sh_from = options_.tuning->sh_step = 0.1;
    options_.tuning->position_rate_first = 1e-3;
    options_.tuning->dc_rate = 2e-2;
  }

  GeometryProblem LuminanceProblem() const {
    GeometryProblem problem;
    for (int i = 0; i < static_cast<int>(scene_.scene.views.size()); ++i) {
      const View& view = scene_.scene.views[i];
      problem.training.push_back({i, view.camera, view.cam_from_world});
    }
    problem.luminance = [this](int view) { return scene_.Luminance(view); };
    problem.initial = InitialGaussians(scene_.scene);
    problem.extent = scene_.scene.Extent();
    return problem;
  }

  GeometryProblem LabProblem(const GeometryState& start, int chroma_degree = 3) const {
    GeometryProblem problem = LuminanceProblem();
    problem.colors = [this](int view) {
      Image lab = scene_.lab[view];
      for (int c = 0; c < 3; ++c) {
        for (size_t i = 0; i < lab.PlaneSize(); ++i) {
          float& value = lab.Plane(c)[i];
          value = c == 0 ? value / 100.0f : value / 255.0f + kNeutralChroma;
        }
      }
      return std::make_shared<const Image>(lab);
    };
    problem.color_space = ColorSpace::kLab;
    problem.chroma_sh_degree = chroma_degree;
    problem.start = &start;
    return problem;
  }

  GaussianModel Train(const GeometryProblem& problem,
                      const GeometryOptions& options,
                      GeometryState* state = nullptr) {
    NoCheckpoints none;
    return TrainGeometry(
        problem, options, {pool_, none, observer_, CancellationToken()}, nullptr, state);
  }

  GeometryState WarmedUp() {
    GeometryState state;
    Train(LuminanceProblem(), options_, &state);
    return state;
  }

  // Mean |ab - truth| of a render of view 2, Lab units.
  double ChromaError(const GaussianModel& model) {
    const View& view = scene_.scene.views[2];
    const Image lab = RenderView(model, view.camera, view.cam_from_world, pool_).lab;
    double sum = 0.0;
    for (size_t i = lab.PlaneSize(); i < lab.data.size(); ++i) {
      sum += std::abs(lab.data[i] - scene_.lab[2].data[i]);
    }
    return sum / (2.0 * static_cast<double>(lab.PlaneSize()));
  }

  ProceduralScene scene_;
  GeometryOptions options_;
  ThreadPool pool_{2};
  NullObserver observer_;
};

TEST_F(JointTrainingTest, WarmUpEndsAtItsShare) {
  EXPECT_EQ(WarmedUp().iteration, 60);
  options_.warm_up = 0.0;
  const GeometryState state = WarmedUp();
  EXPECT_EQ(state.iteration, 0);
  EXPECT_EQ(state.parameters.count(), 400);
}

TEST_F(JointTrainingTest, ContinuedTrainingEqualsUninterruptedOne) {
  const WarmUp saved = {options_, 64, 1 << 20, WarmedUp()};
  const WarmUp read = ParseWarmUp(SerializeWarmUp(saved));
  EXPECT_EQ(read.max_side_px, 64);
  EXPECT_EQ(read.options, saved.options);
  GeometryOptions whole = options_;
  whole.warm_up = 1.0;
  GeometryProblem problem = LuminanceProblem();
  const GaussianModel uninterrupted = Train(problem, whole);
  problem.start = &read.state;
  const GaussianModel continued = Train(problem, whole);
  EXPECT_EQ(SerializeGaussians(continued), SerializeGaussians(uninterrupted));
  EXPECT_NE(continued.size(), 400u) << "densified";
}

TEST_F(JointTrainingTest, RefusesDamagedFile) {
  const std::string bytes = SerializeWarmUp({options_, 64, 1 << 20, WarmedUp()});
  EXPECT_THROW(ParseWarmUp(""), Error);
  EXPECT_THROW(ParseWarmUp(bytes.substr(0, bytes.size() - 1)), Error);
  std::string flipped = bytes;
  flipped[bytes.size() / 2] ^= 1;
  EXPECT_THROW(ParseWarmUp(flipped), Error);
}

TEST_F(JointTrainingTest, ChromaStartsWithValuesOfLuminance) {
  const GeometryState warm_up = WarmedUp();
  const ColorLayout layout{ColorSpace::kLab, 3, 3, 2};
  const GeometryState state = WithChromaFromLuminance(warm_up, 3, layout);
  ASSERT_EQ(state.parameters.rows(), kColorRow + 16 + 2 * 9);
  for (int64_t i = 0; i < state.parameters.count(); ++i) {
    const float l = 0.5f + kShDc * state.parameters.Row(layout.Row(0))[i];
    for (const int c : {1, 2}) {
      EXPECT_NEAR(kNeutralChroma + kShDc * state.parameters.Row(layout.Row(c))[i], l, 1e-6);
      for (int k = 1; k < 9; ++k) {
        EXPECT_EQ(state.parameters.Row(layout.Row(c) + k)[i],
                  warm_up.parameters.Row(kColorRow + k)[i]);
        EXPECT_EQ(state.moments.second.Row(layout.Row(c) + k)[i],
                  warm_up.moments.second.Row(kColorRow + k)[i]);
      }
    }
  }
}

TEST_F(JointTrainingTest, MovesGeometryAndLearnsChroma) {
  const GeometryState warm_up = WarmedUp();
  options_.tuning->densify_until = 0.2;  // so that Gaussians keep their numbers
  const GaussianModel model = Train(LabProblem(warm_up), options_);
  EXPECT_EQ(model.color_space, ColorSpace::kLab);
  EXPECT_EQ(model.chroma_sh_degree, 3);
  ASSERT_EQ(static_cast<int64_t>(model.size()), warm_up.parameters.count());
  double moved = 0.0;
  for (size_t i = 0; i < model.size(); ++i) {
    moved += std::abs(model.position[3 * i] - warm_up.parameters.Row(kPositionRow)[i]);
  }
  EXPECT_GT(moved, 0.0);
  GaussianModel gray = model;
  std::fill(gray.sh_a.begin(), gray.sh_a.end(), 0.0f);
  std::fill(gray.sh_b.begin(), gray.sh_b.end(), 0.0f);
  EXPECT_LT(ChromaError(model), 0.7 * ChromaError(gray));
}

TEST_F(JointTrainingTest, ResumesToTheSameBytes) {
  const GeometryState warm_up = WarmedUp();
  const GeometryProblem problem = LabProblem(warm_up);
  const GaussianModel uninterrupted = Train(problem, options_);
  CancellationToken cancel;
  SaveThenStop store(25, &cancel);
  EXPECT_THROW(TrainGeometry(problem, options_, {pool_, store, observer_, cancel}), Error);
  ASSERT_TRUE(store.saved);
  SaveThenStop again(0, nullptr);
  again.saved = store.saved;
  const GaussianModel resumed =
      TrainGeometry(problem, options_, {pool_, again, observer_, CancellationToken()});
  EXPECT_EQ(SerializeGaussians(resumed), SerializeGaussians(uninterrupted));
}

TEST_F(JointTrainingTest, RefusesWhatDoesNotFit) {
  const GeometryState warm_up = WarmedUp();
  GeometryProblem fewer = LabProblem(warm_up);
  fewer.training.pop_back();
  EXPECT_THROW(Train(fewer, options_), Error);
  GeometryOptions lower = options_;
  lower.sh_degree = 2;
  EXPECT_THROW(Train(LabProblem(warm_up, 2), lower), Error) << "the warm-up has degree 3";
  EXPECT_THROW(Train(LabProblem(warm_up, 3), lower), Error) << "chroma above luminance";
  GeometryProblem without = LabProblem(warm_up);
  without.start = nullptr;
  EXPECT_THROW(Train(without, options_), Error);
}

// Gaussians that came with the scene.
TEST_F(JointTrainingTest, StartsFromGivenGaussians) {
  const GaussianModel given = Train(LuminanceProblem(), options_);
  const GeometryState state = StateOf(given, options_);
  EXPECT_EQ(state.iteration, 60);
  const GaussianModel model = Train(LabProblem(state), options_);
  EXPECT_LT(ChromaError(model), 20.0);
}

}  // namespace
}  // namespace color3d
