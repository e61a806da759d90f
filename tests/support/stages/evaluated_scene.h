// A tiny scene with all inputs of the later stages: photos, a model, chroma of every view.
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "core/color/lab.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {

class EvaluatedSceneTest : public StageTest {
 protected:
  // Three views of a grey ramp, a model, and constant chroma for all views except p2, which is
  // redder.
  void SetUp() override {
    scene_ = RampScene(scratch_.path(), 48, 32);
    AddInput(artifact::kScene, SceneToJson(scene_));
    GaussianModel model = SmallModel();
    model.opacity_logit.assign(model.size(), 6.0f);
    model.log_scale.assign(3 * model.size(), -0.7f);
    AddInput(artifact::kModel, SerializeGaussians(model));
    for (const View& view : scene_.views) {
      Image ab(48, 32, 2, 5.0f);
      if (view.name == "p2.png") std::fill_n(ab.Plane(0), ab.PlaneSize(), 25.0f);
      AddInput(ViewArtifact(artifact::kViewsAb, view, ".png"), EncodeAbPng(ab));
    }
  }
  // The photo's L with chroma (5, 5).
  TruthFile TruthOf(const std::string& name) {
    const Image l = LuminanceFromSrgb(ReadImage(scratch_.path() / name));
    const auto file = scratch_.path() / ("true_" + name);
    WriteFileAtomic(file, EncodePng16(SrgbFromLab(JoinLab(l, Image(48, 32, 2, 5.0f)))));
    return {name, file};
  }
  void AddProvenance(const std::string& name, const Image& shares) {
    AddInput(ViewArtifact(artifact::kProvenance, scene_.views[scene_.FindView(name)], ".png"),
             EncodePng8(shares));
  }

  Scene scene_;
};

// Shares (guessed, seen, inferred) in the left and the right half.
inline Image Halves(const std::array<float, 3>& left, const std::array<float, 3>& right) {
  Image shares(48, 32, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 48; ++x) shares.At(c, y, x) = x < 24 ? left[c] : right[c];
    }
  }
  return shares;
}

}  // namespace color3d
