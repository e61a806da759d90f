// A small scene with a coloured key view, and a scripted generator of pictures, for the stages
// generate_augmentations and personalize.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"

namespace color3d {

inline constexpr int kWidth = 96, kHeight = 72;

// Stripes and a slope, in colour.
inline Image Painting(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      lab.At(0, y, x) = 30.0f + 40.0f * x / width + 10.0f * std::sin(0.3f * y);
      lab.At(1, y, x) = 25.0f * std::sin(0.2f * x);
      lab.At(2, y, x) = 20.0f;
    }
  }
  return lab;
}

class FakeGenerator : public RemoteColorizer {
 public:
  RemoteInfo GetInfo(ProgressObserver&, const CancellationToken&) override { return info; }
  std::string Colorize(const RemoteRequest&, ProgressObserver&, const CancellationToken&) override {
    return "";
  }
  std::vector<std::string> Generate(const RemoteGenerateRequest& request,
                                    ProgressObserver&,
                                    const CancellationToken&) override {
    sent = DecodeImage(request.image_png, "sent");
    requests.push_back(request.kind + " " + std::to_string(request.samples));
    return std::vector<std::string>(static_cast<size_t>(answers), answer);
  }
  inline static RemoteInfo info;
  inline static Image sent;
  inline static std::vector<std::string> requests;
  inline static int answers = 4;
  inline static std::string answer;
};

class AugmentationStageTest : public ::testing::Test {
 protected:
  AugmentationStageTest() {
    const Image lab = Painting(kWidth, kHeight);
    Image gray(kWidth, kHeight, 1);
    for (size_t i = 0; i < gray.PlaneSize(); ++i) {
      gray.data[i] = static_cast<float>(GrayFromLuminance(lab.Plane(0)[i]));
    }
    for (int i = 0; i < 3; ++i) {
      View view;
      view.name = view.image_file = "p" + std::to_string(i) + ".png";
      view.camera = {kWidth, kHeight, 80.0, 80.0, kWidth / 2.0, kHeight / 2.0};
      view.captured_camera = view.camera;
      view.cam_from_world.translation = {0.5 * (1 - i), 0.0, 0.0};
      Write(view.name, EncodePng16(gray));
      scene_.views.push_back(view);
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(ChromaOfLab(lab)));
    options_.max_side_px = kWidth;
    FakeGenerator::info = {"generator 1", {capability::kOutpaint}, 0, true};
    FakeGenerator::requests.clear();
    FakeGenerator::answers = 4;
    FakeGenerator::answer = EncodePng8(SrgbFromLab(Painting(80, 64)));
  }
  void Write(const std::string& name, const std::string& bytes) {
    std::filesystem::create_directories((scratch_.path() / "scene" / name).parent_path());
    WriteFileAtomic(scratch_.path() / "scene" / name, bytes);
  }
  void AddInput(const std::string& name, const std::string& bytes) {
    const auto path = scratch_.path() / ("in" + std::to_string(added_++));
    WriteFileAtomic(path, bytes);
    inputs_[name] = path;
  }
  // A wall of Gaussians at depth 4 that fills all views.
  void AddGeometry() {
    GaussianModel model;
    for (int y = -30; y <= 30; ++y) {
      for (int x = -40; x <= 40; ++x) {
        model.position.insert(model.position.end(), {0.15f * x, 0.15f * y, 4.0f});
        model.log_scale.insert(model.log_scale.end(), 3, std::log(0.12f));
        model.rotation.insert(model.rotation.end(), {1.0f, 0.0f, 0.0f, 0.0f});
        model.opacity_logit.push_back(4.0f);
        model.sh_l.push_back(0.0f);
      }
    }
    AddInput(artifact::kGeometry, SerializeGaussians(model));
  }
  nlohmann::json Run() {
    std::filesystem::remove_all(scratch_.path() / "out");
    std::filesystem::create_directories(scratch_.path() / "out");
    StageContext::Setup setup;
    setup.scene_folder = scratch_.path() / "scene";
    setup.inputs = inputs_;
    setup.output_folder = scratch_.path() / "out";
    setup.scratch_folder = scratch_.path();
    setup.remote_colorizers = [](const std::string&) { return std::make_unique<FakeGenerator>(); };
    StageContext context(setup, none_, observer_, cancel_);
    RunGenerateAugmentations(options_, context);
    outputs_ = context.outputs();
    return nlohmann::json::parse(Output(artifact::kAugmentationFacts));
  }
  std::string Output(const std::string& name) { return ReadFile(scratch_.path() / "out" / name); }
  static std::vector<std::string> Names(const nlohmann::json& facts) {
    std::vector<std::string> names;
    for (const auto& sample : facts.at("samples")) names.push_back(sample.at("name"));
    return names;
  }
  std::string Complaint() {
    try {
      Run();
    } catch (const Error& e) {
      code_ = e.code();
      return e.what();
    }
    return "nothing";
  }

  ScratchFolder scratch_;
  Scene scene_;
  std::map<std::string, std::filesystem::path> inputs_;
  AugmentationOptions options_;
  NoCheckpoints none_;
  NullObserver observer_;
  CancellationToken cancel_;
  std::vector<std::string> outputs_;
  int added_ = 0;
  ErrorCode code_ = ErrorCode::kInternal;
};

}  // namespace color3d
