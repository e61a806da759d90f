// Live colorization with the embedded encoder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/colorizer/model/tensor_file.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/image/codec.h"
#include "server/base/service_error.h"
#include "server/storage/file_blob_store.h"
#include "server/worker/live/live_engine.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;
using Request = internal::v1::ColorizeImageRequest;
using Response = internal::v1::ColorizeImageResponse;

// Stripes and a textured blob, L 20..80, constant ab.
Image TintedLab(float a, float b, int width = 96, int height = 80) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double wave = std::sin(0.3 * x) * std::cos(0.2 * y) + std::sin(0.05 * x * y);
      lab.At(0, y, x) = static_cast<float>(50.0 + 15.0 * wave);
      lab.At(1, y, x) = a;
      lab.At(2, y, x) = b;
    }
  }
  return lab;
}
std::string GrayPng(int width = 96, int height = 80) {
  return EncodePng8(SrgbFromLab(LuminanceOfLab(TintedLab(0, 0, width, height))));
}

struct MeanLab {
  double l = 0.0, a = 0.0, b = 0.0;
};
MeanLab MeanOf(const Image& lab) {
  MeanLab mean;
  const auto n = static_cast<double>(lab.PlaneSize());
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    mean.l += lab.Plane(0)[i] / n;
    mean.a += lab.Plane(1)[i] / n;
    mean.b += lab.Plane(2)[i] / n;
  }
  return mean;
}

class CoreLiveEngineTest : public ::testing::Test {
 protected:
  CoreLiveEngineTest() : engine_(MakeLiveEngine({blobs_, {}, 1})) {}

  std::string Put(const std::string& bytes) { return blobs_.PutBytes(bytes).sha256; }
  std::string Example(float a, float b) { return Put(EncodePng8(SrgbFromLab(TintedLab(a, b)))); }
  static Request ByExample(const std::string& example, const std::string& image) {
    Request request;
    request.set_example_sha256(example);
    request.set_image(image);
    return request;
  }
  // Answers of the engine to a batch; an error is given by its text.
  std::vector<std::string> Run(const std::vector<Request>& requests) {
    responses_.assign(requests.size(), {});
    std::vector<LiveTask> tasks;
    for (size_t i = 0; i < requests.size(); ++i) {
      tasks.push_back({&requests[i], &responses_[i], nullptr});
    }
    engine_->Colorize(tasks);
    std::vector<std::string> errors;
    for (const LiveTask& task : tasks) {
      errors.emplace_back();
      try {
        if (task.error) std::rethrow_exception(task.error);
      } catch (const Error& e) {
        errors.back() = ReasonOf(e) + ": " + e.what();
      }
    }
    return errors;
  }
  Image LabOf(size_t i) { return LabFromSrgb(DecodeImage(responses_[i].image(), "the answer")); }

  ScratchFolder scratch_;
  FileBlobStore blobs_{scratch_.path() / "blobs", {0}};
  std::unique_ptr<LiveEngine> engine_;
  std::vector<Response> responses_;
};

TEST_F(CoreLiveEngineTest, KeepsExamplesApartAndLuminance) {
  const std::string red = Example(40, 15), blue = Example(-5, -30);
  std::vector<Request> requests;
  for (int i = 0; i < 6; ++i) {
    requests.push_back(ByExample(i % 2 == 0 ? red : blue, GrayPng(96 + 16 * (i / 2))));
  }
  for (const std::string& error : Run(requests)) EXPECT_EQ(error, "");
  for (size_t i = 0; i < 6; ++i) {
    const MeanLab mean = MeanOf(LabOf(i));
    EXPECT_NEAR(mean.a, i % 2 == 0 ? 40 : -5, 4) << i;
    EXPECT_NEAR(mean.b, i % 2 == 0 ? 15 : -30, 4) << i;
    const Image captured = LuminanceFromSrgb(DecodeImage(requests[i].image(), "the picture"));
    const Image lab = LabOf(i);
    double worst = 0.0;
    for (size_t p = 0; p < captured.PlaneSize(); ++p) {
      worst = std::max<double>(worst, std::abs(captured.Plane(0)[p] - lab.Plane(0)[p]));
    }
    EXPECT_LT(worst, 0.6) << "more than 8 bits lose";
    EXPECT_EQ(responses_[i].encoder_digest(), Encoder::Embedded()->digest());
  }
}

TEST_F(CoreLiveEngineTest, AcceptsColorAnd16BitPicturesAndSizes) {
  const std::string red = Example(40, 15);
  std::vector<Request> requests = {
      ByExample(red, EncodePng8(SrgbFromLab(TintedLab(-20, 20)))),
      ByExample(red, EncodePng16(SrgbFromLab(LuminanceOfLab(TintedLab(0, 0))))),
      ByExample(red, GrayPng()),
      ByExample(red, "")};
  requests[2].set_max_side_px(48);
  requests[3].set_image_sha256(Put(GrayPng()));
  for (const std::string& error : Run(requests)) EXPECT_EQ(error, "");
  for (size_t i = 0; i < requests.size(); ++i) EXPECT_NEAR(MeanOf(LabOf(i)).a, 40, 4) << i;
  EXPECT_EQ(LabOf(2).width, 48);
  EXPECT_EQ(LabOf(2).height, 40);
}

TEST_F(CoreLiveEngineTest, SpreadsStrokes) {
  Request strokes;
  strokes.set_image(GrayPng());
  strokes.set_points(R"([{"x": 20, "y": 20, "radius": 3, "color": "#c04030"}])");
  Request bad = strokes;
  bad.set_points(R"([{"x": 20}])");
  Request automatic = strokes;
  automatic.set_points(R"([{"x": 20, "y": 20, "keep": "auto"}])");
  Request small = strokes;
  small.set_max_side_px(48);
  const auto errors = Run({strokes, bad, automatic, small});
  EXPECT_EQ(errors[0], "");
  EXPECT_GT(MeanOf(LabOf(0)).a, 10);
  EXPECT_THAT(errors[1], HasSubstr("INVALID_ARGUMENT"));
  EXPECT_EQ(errors[2], "");
  EXPECT_EQ(errors[3], "");
  EXPECT_EQ(LabOf(3).width, 48);
  EXPECT_EQ(responses_[0].encoder_digest(), "");
}

TEST_F(CoreLiveEngineTest, BadPictureFailsAlone) {
  const std::string red = Example(40, 15), grey = Put(GrayPng());
  const std::string huge = EncodePng8(Image(6000, 4300, 1));
  Request unknown_model = ByExample(red, GrayPng());
  unknown_model.clear_example_sha256();
  unknown_model.set_colorizer_sha256(red);
  Request no_colorizer = unknown_model;
  unknown_model.set_encoder("mine");
  const auto errors = Run({ByExample(red, GrayPng()),
                           ByExample(red, GrayPng().substr(0, 200)),
                           ByExample(red, "no picture"),
                           ByExample(red, huge),
                           ByExample(grey, GrayPng()),
                           unknown_model,
                           no_colorizer,
                           ByExample(red, GrayPng())});
  EXPECT_EQ(errors[0], "");
  EXPECT_THAT(errors[1], HasSubstr("truncated"));
  EXPECT_THAT(errors[2], HasSubstr("is not an image"));
  EXPECT_THAT(errors[3], HasSubstr("RESOURCE_EXHAUSTED: the picture"));
  EXPECT_THAT(errors[4], HasSubstr("NO_COLOR"));
  EXPECT_THAT(errors[5], HasSubstr("UNKNOWN_MODEL"));
  EXPECT_THAT(errors[6], HasSubstr("colorizer file"));
  EXPECT_EQ(errors[7], "");
  EXPECT_NEAR(MeanOf(LabOf(7)).a, 40, 4);
}

TEST_F(CoreLiveEngineTest, RefusesColorizerOfOtherEncoder) {
  ColorizerOptions options;
  options.iterations = 0;
  options.max_side_px = 64;
  ThreadPool pool(1);
  NoCheckpoints checkpoints;
  NullObserver progress;
  const Image lab = TintedLab(40, 15);
  const std::string bytes = TrainColorizer(Encoder::Embedded(),
                                           {{"key", LuminanceOfLab(lab), ChromaOfLab(lab)}},
                                           options,
                                           {pool, checkpoints, progress, CancellationToken()})
                                ->Serialize();
  TensorFile file = ReadTensorFile(bytes, kColorizerFormat, "it");
  const std::string digest = Encoder::Embedded()->digest(), other(64, 'f');
  ASSERT_EQ(file.facts.at("encoder"), digest);
  file.facts["encoder"] = other;
  Request own, foreign;
  own.set_colorizer_sha256(Put(bytes));
  foreign.set_colorizer_sha256(Put(WriteTensorFile(file, kColorizerFormat)));
  own.set_image(GrayPng());
  foreign.set_image(GrayPng());
  const auto errors = Run({own, foreign, own});
  EXPECT_EQ(errors[0] + errors[2], "");
  EXPECT_NEAR(MeanOf(LabOf(2)).a, 40, 4);
  EXPECT_THAT(errors[1], HasSubstr("FAILED_PRECONDITION"));
  EXPECT_THAT(errors[1], HasSubstr(digest));
  EXPECT_THAT(errors[1], HasSubstr(other));
}

// A PNG of noise does not compress.
TEST_F(CoreLiveEngineTest, AnswersLargeResultsAsBlobs) {
  Image noise(1500, 1200, 1);
  uint32_t state = 1;
  for (float& value : noise.data) {
    state = state * 1664525u + 1013904223u;
    value = static_cast<float>(state >> 8) / 16777216.0f;
  }
  const auto errors = Run({ByExample(Example(40, 15), EncodePng8(noise))});
  EXPECT_EQ(errors[0], "");
  EXPECT_TRUE(responses_[0].image().empty());
  const std::string png = ReadFile(blobs_.Fetch(responses_[0].image_sha256()));
  EXPECT_EQ(static_cast<int64_t>(png.size()), responses_[0].image_size_bytes());
  EXPECT_EQ(DecodeImage(png, "the answer").width, 1500);
}

Request ByPoints(const std::string& points, const std::string& image, int side = 0) {
  Request request;
  request.set_points(points);
  request.set_image(image);
  request.set_max_side_px(side);
  return request;
}

TEST_F(CoreLiveEngineTest, StrokesAreSolvedAtTheSizeOfTheAnswer) {
  const std::string image = GrayPng(480, 400);
  const std::string stroke =
      R"([{"line": [[40, 40], [440, 360]], "width": 9, "color": "#b04040"},
          {"x": 470.5, "y": 399.5, "radius": 0.5, "color": "#b04040"}])";
  const auto errors = Run({ByPoints(stroke, image), ByPoints(stroke, image, 120)});
  EXPECT_EQ(errors, (std::vector<std::string>{"", ""}));
  const MeanLab whole = MeanOf(LabOf(0)), small = MeanOf(LabOf(1));
  EXPECT_EQ(LabOf(0).width, 480);
  EXPECT_EQ(LabOf(1).width, 120);
  EXPECT_NEAR(whole.a, small.a, 1.0);
  EXPECT_NEAR(whole.b, small.b, 1.0);
  EXPECT_GT(small.a, 20.0);
}

TEST_F(CoreLiveEngineTest, StrokesLieAboveAPictureOrAutomaticColors) {
  const std::string image = GrayPng(240, 200);
  const std::string stroke = R"([{"x": 30, "y": 30, "radius": 6, "color": "#b04040"}])";
  Request above = ByPoints(stroke, image);
  above.set_below_sha256(Put(EncodePng8(SrgbFromLab(TintedLab(-30, 20, 240, 200)))));
  Request automatic = ByPoints("", image), above_automatic = ByPoints(stroke, image);
  automatic.set_automatic(true);
  above_automatic.set_automatic(true);
  Request other_shape = above;
  other_shape.set_below_sha256(Put(EncodePng8(SrgbFromLab(TintedLab(-30, 20, 240, 100)))));
  const auto errors = Run({above, automatic, above_automatic, other_shape});
  EXPECT_EQ(errors[0] + errors[1] + errors[2], "");
  EXPECT_THAT(errors[3], HasSubstr("below the strokes has 240x100 px, the photo 240x200"));
  const Image lab = LabOf(0);
  EXPECT_GT(lab.At(1, 30, 30), 25.0f);
  EXPECT_NEAR(lab.At(1, 180, 220), -30.0f, 2.0f);
  const Image guessed = LabOf(1), with_stroke = LabOf(2);
  EXPECT_GT(with_stroke.At(1, 30, 30), 25.0f);
  EXPECT_NEAR(with_stroke.At(1, 180, 220), guessed.At(1, 180, 220), 1e-3f);
}

}  // namespace
}  // namespace color3d
