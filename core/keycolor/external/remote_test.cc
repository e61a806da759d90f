#include "core/keycolor/external/remote.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/color/lab.h"
#include "core/image/codec.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kWidth = 96;
constexpr int kHeight = 64;

Image Ramp() {
  Image luminance(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) luminance.At(0, y, x) = 20.0f + 60.0f * x / kWidth;
  }
  return luminance;
}

// The sent picture in sepia, with its luminance raised by `lift` L units.
std::string Sepia(const std::string& sent_png, int width, int height, float lift = 0.0f) {
  Image l = LuminanceFromSrgb(Resize(DecodeImage(sent_png, "sent"), width, height));
  for (float& value : l.data) value += lift;
  Image ab(width, height, 2, 10.0f);
  std::fill_n(ab.Plane(1), ab.PlaneSize(), 20.0f);
  return EncodePng8(SrgbFromLab(JoinLab(l, ab)));
}

class FakeRemote : public RemoteColorizer {
 public:
  RemoteInfo GetInfo(ProgressObserver&, const CancellationToken&) override { return info; }
  std::string Colorize(const RemoteRequest& r,
                       ProgressObserver&,
                       const CancellationToken&) override {
    request = r;
    return answer(r);
  }
  RemoteInfo info{"fake 1", {capability::kAutomatic}, 0, true};
  RemoteRequest request;
  std::function<std::string(const RemoteRequest&)> answer = [](const RemoteRequest& r) {
    return Sepia(r.image_png, kWidth, kHeight);
  };
};

class RemoteTest : public ::testing::Test {
 protected:
  RemoteTest() { options_.name = "fake"; }
  RemoteSolution Solve() {
    return KeyColorFromRemote(luminance_, options_, remote_, null_, cancel_);
  }
  std::string Complaint() {
    try {
      Solve();
    } catch (const Error& e) {
      code_ = e.code();
      return e.what();
    }
    return "";
  }

  Image luminance_ = Ramp();
  RemoteOptions options_;
  FakeRemote remote_;
  NullObserver null_;
  CancellationToken cancel_;
  ErrorCode code_ = ErrorCode::kInternal;
};

TEST_F(RemoteTest, ReturnsChromaAndFacts) {
  options_.seed = 7;
  options_.idempotency_key = "jobs/1/2";
  const RemoteSolution solution = Solve();
  ASSERT_EQ(solution.ab.width, kWidth);
  ASSERT_EQ(solution.ab.channels, 2);
  EXPECT_NEAR(solution.ab.At(0, 30, 50), 10.0f, 1.0f);
  EXPECT_NEAR(solution.ab.At(1, 30, 50), 20.0f, 1.0f);
  EXPECT_LT(solution.mean_luminance_difference, 0.5);
  EXPECT_GT(solution.luminance_correlation, 0.99);
  EXPECT_TRUE(solution.warnings.empty());
  EXPECT_EQ(remote_.request.idempotency_key, "jobs/1/2");
  EXPECT_EQ(remote_.request.seed, 0u) << "it does not support seeds";
  const Image sent = DecodeImage(remote_.request.image_png, "sent");
  EXPECT_EQ(sent.channels, 1);
  EXPECT_NEAR(LuminanceFromGray(sent.At(0, 3, 50)), luminance_.At(0, 3, 50), 0.01) << "16 bits";
  remote_.info.capabilities.insert(capability::kSeed);
  Solve();
  EXPECT_EQ(remote_.request.seed, 7u);
}

TEST_F(RemoteTest, ChangedLuminanceIsReportedAndReplaced) {
  remote_.answer = [](const RemoteRequest& r) { return Sepia(r.image_png, kWidth, kHeight, 9.0f); };
  const RemoteSolution solution = Solve();
  EXPECT_NEAR(solution.mean_luminance_difference, 9.0, 0.5);
  ASSERT_EQ(solution.warnings.size(), 1u);
  EXPECT_THAT(solution.warnings[0], HasSubstr("changed the luminance"));
}

TEST_F(RemoteTest, ScalesLargePhotoWithItsPointsAndMask) {
  remote_.info.max_pixels = 72 * 64;
  remote_.info.capabilities = {capability::kColorPoints, capability::kMask};
  options_.points = {{48.0, 32.0, 2.0, 30.0, 30.0}};
  options_.mask = Image(kWidth, kHeight, 1, 1.0f);
  options_.mask.At(0, 5, 5) = 0.0f;
  remote_.answer = [](const RemoteRequest& r) {
    const Image sent = DecodeImage(r.image_png, "sent");
    return Sepia(r.image_png, sent.width, sent.height);
  };
  const RemoteSolution solution = Solve();
  EXPECT_EQ(solution.sent_width, 83);
  EXPECT_EQ(solution.sent_height, 55);
  EXPECT_EQ(solution.ab.width, kWidth);
  EXPECT_EQ(solution.ab.At(0, 5, 5), 0.0f) << "no colour outside the mask";
  EXPECT_NEAR(solution.ab.At(0, 20, 20), 10.0f, 1.5f);
  ASSERT_EQ(remote_.request.points.size(), 1u);
  EXPECT_NEAR(remote_.request.points[0].x_px, 48.0 * 83 / 96, 1e-9);
  EXPECT_EQ(remote_.request.points[0].color.size(), 7u);
  EXPECT_EQ(DecodeImage(remote_.request.mask_png, "mask").width, 83);
  ASSERT_FALSE(solution.warnings.empty());
  EXPECT_THAT(solution.warnings[0], HasSubstr("83x55"));
}

TEST_F(RemoteTest, SendsOnlySupportedInputs) {
  options_.prompt = "red";
  EXPECT_THAT(
      Complaint(),
      AllOf(HasSubstr("'fake'"), HasSubstr("text_prompt"), HasSubstr("it supports: automatic")));
  EXPECT_EQ(code_, ErrorCode::kFailedPrecondition);
  options_.prompt.clear();
  remote_.info.capabilities.clear();
  EXPECT_THAT(Complaint(), AllOf(HasSubstr("automatic"), HasSubstr("it supports: nothing")));
  EXPECT_TRUE(remote_.request.image_png.empty()) << "nothing was sent";
}

TEST_F(RemoteTest, RefusesUnusableAnswers) {
  const auto complaint = [&](std::string bytes) {
    remote_.answer = [bytes](const RemoteRequest&) { return bytes; };
    const std::string text = Complaint();
    EXPECT_EQ(code_, ErrorCode::kFailedPrecondition) << text;
    return text;
  };
  Image gray = luminance_;
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  const std::string sent = EncodePng16(gray);
  EXPECT_THAT(complaint("garbage"), HasSubstr("is not an image"));
  EXPECT_THAT(complaint(""), HasSubstr("usable picture"));
  EXPECT_THAT(complaint(EncodeJpeg(Image(kWidth, kHeight, 3, 0.5f))), HasSubstr("is not a PNG"));
  const std::string whole = Sepia(sent, kWidth, kHeight);
  EXPECT_THAT(complaint(whole.substr(0, whole.size() / 2)), HasSubstr("truncated"));
  EXPECT_THAT(complaint(Sepia(sent, kHeight, kWidth)),
              AllOf(HasSubstr("64x96"), HasSubstr("96x64")));
  EXPECT_THAT(complaint(Sepia(sent, 2 * kWidth + 2, 2 * kHeight + 2)), HasSubstr("the limit"));
  EXPECT_THAT(complaint(sent), HasSubstr("grey picture"));
  EXPECT_THAT(complaint(EncodePng8(SrgbFromLab(luminance_))), HasSubstr("without colour"));
  Image mirrored = luminance_;
  for (float& value : mirrored.data) value = 100.0f - value;
  Image ab(kWidth, kHeight, 2, 20.0f);
  EXPECT_THAT(complaint(EncodePng8(SrgbFromLab(JoinLab(mirrored, ab)))),
              HasSubstr("something else"));
}

TEST_F(RemoteTest, RefusesBadInputBeforeSending) {
  remote_.info.capabilities = {capability::kColorPoints, capability::kMask};
  options_.points = {{96.0, 3.0, 2.0, 0.0, 0.0}};
  EXPECT_THAT(Complaint(), HasSubstr("outside the key view of 96x64"));
  EXPECT_EQ(code_, ErrorCode::kInvalidArgument);
  options_.points[0].x_px = 3.0;
  options_.points[0].shape = ColorHint::Shape::kLine;
  EXPECT_THAT(Complaint(), HasSubstr("takes points with colours"));
  options_.points[0].shape = ColorHint::Shape::kDisc;
  options_.mask = Image(4, 4, 1);
  EXPECT_THAT(Complaint(), HasSubstr("the mask is 4x4"));
  EXPECT_TRUE(remote_.request.image_png.empty());
}

}  // namespace
}  // namespace color3d
