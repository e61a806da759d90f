#include "core/keycolor/external/script.h"

#include <gtest/gtest.h>
#include <torch/script.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

class ScriptTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = std::filesystem::temp_directory_path() /
            ("color3d_script_" + std::to_string(getpid()) + ".pt");
  }
  void TearDown() override { std::filesystem::remove(file_); }

  // Saves a module whose forward(self, x) has this body.
  void Save(const std::string& body) {
    torch::jit::Module module("colorizer");
    module.define("def forward(self, x):\n" + body);
    module.save(file_.string());
  }
  std::string MessageOf(const std::string& body) {
    Save(body);
    try {
      KeyColorFromScript(luminance_, file_);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      return error.what();
    }
    return "";
  }

  std::filesystem::path file_;
  Image luminance_ = Image(50, 37, 1, 60.0f);
};

TEST_F(ScriptTest, ReturnsAbUnchanged) {
  for (int y = 0; y < 37; ++y) luminance_.At(0, y, 7) = 20.0f;
  Save("  return torch.cat([x * 0.5, -x * 0.25], 1)\n");
  const ScriptColor color = KeyColorFromScript(luminance_, file_);
  ASSERT_EQ(color.ab.width, 50);
  ASSERT_EQ(color.ab.height, 37);
  EXPECT_EQ(color.ab.At(0, 36, 49), 30.0f);
  EXPECT_EQ(color.ab.At(1, 36, 49), -15.0f);
  EXPECT_EQ(color.ab.At(0, 10, 7), 10.0f);
  EXPECT_EQ(color.luminance_deviation, 0.0);
}

TEST_F(ScriptTest, KeepsLuminanceOfPhotoForSrgb) {
  // The sRGB picture's own L is about 53 (red) everywhere.
  Save("  z = x * 0.0\n  return (torch.cat([z + 1.0, z, z], 1), z)\n");
  const ScriptColor color = KeyColorFromScript(luminance_, file_);
  EXPECT_NEAR(color.ab.At(0, 5, 5), 80.09f, 0.05f);
  EXPECT_NEAR(color.luminance_deviation, 60.0 - 53.24, 0.1);
}

TEST_F(ScriptTest, UpsamplesSmallOutput) {
  Save("  return torch.cat([x, x], 1)[:, :, ::4, ::4] * 0.1\n");
  const ScriptColor color = KeyColorFromScript(luminance_, file_);
  ASSERT_EQ(color.ab.width, 50);
  EXPECT_NEAR(color.ab.At(0, 36, 49), 6.0f, 1e-3f);
}

TEST_F(ScriptTest, NamesUnusableOutput) {
  const auto expect = [&](const std::string& body, const char* say) {
    const std::string message = MessageOf(body);
    EXPECT_NE(message.find(say), std::string::npos) << message;
    EXPECT_NE(message.find(file_.filename().string()), std::string::npos) << message;
  };
  expect("  return x\n", "[1, 1, 64, 64]");
  expect("  return torch.cat([x, x], 1)[0]\n", "[2, 64, 64]");
  expect("  return torch.cat([x, x], 1).int()\n", "type int");
  expect("  return torch.cat([x, x], 1) * float('nan')\n", "nan");
  expect("  return torch.cat([x, x], 1) * 100.0\n", "6000");
  expect("  return torch.cat([x, x, x], 1)\n", "the value 60;");
  expect("  return 3\n", "returned a Int");
  expect("  assert x.size(0) > 1, 'no colours today'\n  return x\n", "no colours today");
  expect("  return torch.cat([x, torch.ones(1)], 1)\n", "failed");
}

TEST_F(ScriptTest, RefusesOtherFiles) {
  WriteFileAtomic(file_, "this is not a zip archive");
  EXPECT_THROW(KeyColorFromScript(luminance_, file_), Error);
  std::filesystem::remove(file_);
  EXPECT_THROW(KeyColorFromScript(luminance_, file_), Error);
}

}  // namespace
}  // namespace color3d
