// The painter's files and formulas against the code of the service: the strokes that it writes, the
// pixels that they cover, Lab, edge weights. Its own tests (*_test.ts) read the same fixtures.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "client/options/key_color_flags.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/parallel.h"
#include "core/base/run_control.h"
#include "core/color/lab.h"
#include "core/grid/edge_weights.h"
#include "core/keycolor/hints/hint_map.h"
#include "core/keycolor/hints/hints.h"

namespace color3d {
namespace {

constexpr int kWidth = 40, kHeight = 24;
constexpr int kEdgeWidth = 9, kEdgeHeight = 7;
constexpr double kEdgeSigma = 3.0;

std::string Fixture(const std::string& name) {
  return std::string(COLOR3D_PAINT_FIXTURES) + "/" + name;
}

// For each row of the photo a letter a pixel: the last entry that covers it (0-9, a-z), or a dot.
std::vector<std::string> Coverage(const std::vector<ColorHint>& hints) {
  std::vector<std::string> rows(kHeight, std::string(kWidth, '.'));
  NullObserver progress;
  for (size_t k = 0; k < hints.size(); ++k) {
    const HintMap map = DrawHints({hints[k]}, {}, kWidth, kHeight, progress, CancellationToken());
    for (int i = 0; i < kWidth * kHeight; ++i) {
      if (map.hinted[i]) rows[i / kWidth][i % kWidth] = "0123456789abcdefghijklmnopqrstuvwxyz"[k];
    }
  }
  return rows;
}

Image EdgePhoto() {
  Image luminance(kEdgeWidth, kEdgeHeight, 1);
  for (int i = 0; i < kEdgeWidth * kEdgeHeight; ++i) {
    luminance.data[i] = static_cast<float>((i * 37) % 101) * (i % 3 == 0 ? 1.0f : 0.25f);
  }
  return luminance;
}

std::vector<float> Weights(const GridPlane& plane) {
  std::vector<float> weights;
  for (int i = 0; i < kEdgeWidth * kEdgeHeight; ++i) weights.push_back(plane[i]);
  return weights;
}

nlohmann::json OfService() {
  nlohmann::json colors = nlohmann::json::array();
  for (const unsigned value : {0x000000u, 0x0a0502u, 0xa0522du, 0x00ff00u, 0x1e3cffu, 0xffffffu}) {
    const LabColor lab = LabFromSrgb(
        RgbColor{(value >> 16) / 255.0, (value >> 8 & 255) / 255.0, (value & 255) / 255.0});
    char hex[8];
    snprintf(hex, sizeof(hex), "#%06x", value);
    colors.push_back({{"hex", hex}, {"lab", {lab.l, lab.a, lab.b}}});
  }
  ThreadPool pool(1);
  const Image photo = EdgePhoto();
  const GridSystem system = SystemOfLuminance(photo, kEdgeSigma, pool);
  return {{"width", kWidth},
          {"height", kHeight},
          {"coverage", Coverage(ParseHintsJson(ReadFile(Fixture("strokes.json"))))},
          {"colors", colors},
          {"edges",
           {{"width", kEdgeWidth},
            {"height", kEdgeHeight},
            {"sigma", kEdgeSigma},
            {"luminance", photo.data},
            {"right", Weights(system.right)},
            {"down", Weights(system.down)}}}};
}

// Numbers agree to 1e-6, all else exactly.
void ExpectNear(const nlohmann::json& found, const nlohmann::json& wanted, const std::string& at) {
  if (found.is_number() && wanted.is_number()) {
    EXPECT_NEAR(found.get<double>(), wanted.get<double>(), 1e-6) << at;
    return;
  }
  ASSERT_EQ(found.is_structured(), wanted.is_structured()) << at;
  if (!found.is_structured()) {
    EXPECT_EQ(found, wanted) << at;
    return;
  }
  ASSERT_EQ(found.size(), wanted.size()) << at;
  for (const auto& [key, value] : found.items()) {
    const auto index = found.is_array() ? std::stoul(key) : 0;
    ExpectNear(value, found.is_array() ? wanted.at(index) : wanted.at(key), at + "/" + key);
  }
}

TEST(PaintFormatTest, CommandLineTakesStrokesOfPainter) {
  client::KeyColorFlags flags;
  flags.hints = Fixture("strokes.json");
  EXPECT_NO_THROW(flags.Check());
  EXPECT_EQ(ParseHintsJson(ReadFile(flags.hints)).size(), 9u);
}

// service.json is what the painter's tests compare with. COLOR3D_WRITE_FIXTURES=1 writes it anew.
TEST(PaintFormatTest, FixtureOfPainterIsOfThisService) {
  const nlohmann::json service = OfService();
  if (std::getenv("COLOR3D_WRITE_FIXTURES") != nullptr) {
    WriteFileAtomic(Fixture("service.json"), service.dump(1) + "\n");
  }
  ExpectNear(service, nlohmann::json::parse(ReadFile(Fixture("service.json"))), "");
}

// A hole and a further part hang on a region by edges that are walked to and fro.
TEST(PaintFormatTest, RegionOfPainterMayHaveHoles) {
  const auto rows = Coverage(ParseHintsJson(
      R"([{"region": [[0, 0], [12, 0], [12, 12], [0, 12], [0, 0], [4, 4], [4, 8], [8, 8], [8, 4], [4, 4],
          [0, 0], [20, 2], [22, 2], [22, 4], [20, 4], [20, 2]], "color": "#a0522d"}])"));
  EXPECT_EQ(rows[1].substr(0, 24), "000000000000............");
  EXPECT_EQ(rows[2].substr(0, 24), "000000000000........00..");
  EXPECT_EQ(rows[5].substr(0, 24), "0000....0000............");
}

}  // namespace
}  // namespace color3d
