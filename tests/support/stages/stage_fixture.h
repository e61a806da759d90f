// Fixture of the tests of stages: a context on a scratch folder, and a tiny scene.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/image/codec.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"

namespace color3d {

class Warnings : public NullObserver {
 public:
  void OnWarning(const std::string& message) override { text += message + "\n"; }
  void OnError(int64_t, const std::string& error_name, double value) override {
    errors[error_name].push_back(value);
  }
  std::string text;
  std::map<std::string, std::vector<double>> errors;  // by name
};

// Records all states, and throws at one of them.
class DyingCheckpoints : public CheckpointStore {
 public:
  std::optional<std::string> Load() override {
    return states.empty() ? std::nullopt : std::optional(states.back());
  }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override {
    if (states.size() < dies_at || dies_at == 0) states.push_back(state);
    if (states.size() == dies_at) throw Error(ErrorCode::kAborted, "the lease is lost");
  }
  std::vector<std::string> states;
  size_t dies_at = 0;  // 0: never
};

class StageTest : public ::testing::Test {
 protected:
  StageContext MakeContext() {
    std::filesystem::create_directories(scratch_.path() / "out");
    return StageContext({.scene_folder = scratch_.path(),
                         .inputs = inputs_,
                         .output_folder = scratch_.path() / "out",
                         .scratch_folder = scratch_.path(),
                         .seed = seed_,
                         .memory_bytes = memory_bytes_,
                         .models = models_,
                         .remote_colorizers = remote_},
                        *checkpoints_,
                        observer_,
                        cancel_);
  }
  void AddInput(const std::string& name, const std::string& bytes) {
    const auto path = scratch_.path() / ("in" + std::to_string(added_++));
    WriteFileAtomic(path, bytes);
    inputs_[name] = path;
  }
  // Runs a stage, adds its artifacts below `folder` to the inputs, and returns their names.
  template <class Stage>
  std::vector<std::string> RunForInputs(const Stage& stage, const std::string& folder = "") {
    StageContext context = MakeContext();
    stage(context);
    for (const std::string& name : context.outputs()) {
      AddInput(folder + name, ReadFile(scratch_.path() / "out" / name));
    }
    return context.outputs();
  }
  // Colours an additional key view and adds it to the inputs. Returns its name.
  std::string AddKeyView(const ColorizeKeyViewOptions& options) {
    RunForInputs([&](StageContext& context) { RunColorizeKeyView(options, context); },
                 artifact::kKeyViews + std::to_string(++added_key_views_) + "/");
    return options.view;
  }

  ScratchFolder scratch_;
  std::map<std::string, std::filesystem::path> inputs_;
  NoCheckpoints none_;
  CheckpointStore* checkpoints_ = &none_;
  Warnings observer_;
  CancellationToken cancel_;
  uint64_t seed_ = 1;
  int64_t memory_bytes_ = 0;
  std::map<std::string, std::filesystem::path> models_;
  RemoteColorizerFactory remote_;
  int added_key_views_ = 0;
  int added_ = 0;  // number of added inputs, with replaced ones
};

// Three photos of a ramp with synthetic poses, as an imported scene.
inline Scene RampScene(const std::filesystem::path& folder, int width, int height) {
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    Image gray(width, height, 1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        gray.At(0, y, x) = static_cast<float>(x + y + i) / (width + height + 3);
      }
    }
    View view;
    view.name = "p" + std::to_string(i) + ".png";
    view.image_file = view.name;
    view.camera = {width, height, 50.0, 50.0, width / 2.0, height / 2.0};
    view.captured_camera = view.camera;
    view.cam_from_world.translation = {0.1 * i, 0.0, 0.0};
    view.held_out = i == 0;
    WriteFileAtomic(folder / view.image_file, EncodePng8(gray));
    scene.views.push_back(view);
  }
  return scene;
}

// A dark wall, and in front of it a bright ball that moves from x = -0.4 at begin_s to x = 0.4 at
// end_s, at depth kBallDepth.
inline constexpr float kBallDepth = 1.5f;
inline GaussianModel BallBeforeWall(double begin_s, double end_s) {
  GaussianModel model;
  model.channels = 3;
  const auto add = [&model](float depth, float log_scale, float sh_l) {
    model.position.insert(model.position.end(), {0.0f, 0.0f, depth});
    model.log_scale.insert(model.log_scale.end(), 3, log_scale);
    model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
    model.opacity_logit.push_back(6.0f);
    model.sh_l.push_back(sh_l);
    model.sh_a.push_back(0.1f);
    model.sh_b.push_back(0.1f);
  };
  add(6.0f, 1.5f, -1.0f);
  add(kBallDepth, -2.5f, 1.5f);
  model.motion.begin_s = begin_s;
  model.motion.end_s = end_s;
  model.motion.velocity = {0.4f, 0.0f, 0.0f};
  model.motion.acceleration = {0.0f, 0.0f, 0.0f};
  model.motion.spin = {0.0f, 0.0f, 0.0f, 0.0f};
  model.motion.center = {0.0f};
  model.motion.log_width = {5.0f};
  return model;
}

// A few Gaussians in front of RampScene's cameras.
inline GaussianModel SmallModel() {
  GaussianModel model;
  model.channels = 3;
  for (int i = 0; i < 9; ++i) {
    model.position.insert(model.position.end(), {0.3f * (i % 3) - 0.3f, 0.2f * (i / 3), 2.0f});
    model.log_scale.insert(model.log_scale.end(), {-1.5f, -1.5f, -1.5f});
    model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
    model.opacity_logit.push_back(1.0f);
    model.sh_l.push_back(0.1f * i);
    model.sh_a.push_back(0.1f * (i % 2));
    model.sh_b.push_back(-0.1f * (i % 3));
  }
  return model;
}

}  // namespace color3d
