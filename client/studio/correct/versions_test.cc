#include "client/studio/correct/versions.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d::client {
namespace {

v1::JobSpec RunSpec() {
  v1::JobSpec spec;
  spec.set_scene("scenes/1");
  spec.mutable_colorize_scene()->set_key_view("a.jpg");
  return spec;
}

v1::FurtherKeyView PointsOn(const std::string& view, char digit) {
  v1::FurtherKeyView correction;
  correction.set_view(view);
  correction.mutable_color()->mutable_points()->set_sha256(std::string(64, digit));
  correction.mutable_color()->mutable_points()->set_size_bytes(10);
  return correction;
}

TEST(VersionsTest, DifferInCorrectionsAndToneAlone) {
  const v1::JobSpec plain = RunSpec();
  VersionChange change;
  change.add = PointsOn("a.jpg", '1');
  change.saturation = 1.5;
  change.warmth = -3.0;
  const v1::JobSpec changed = Changed(plain, change);
  EXPECT_EQ(WithoutCorrections(changed), WithoutCorrections(plain));
  EXPECT_EQ(changed.colorize_scene().correct_colors().corrections_size(), 1);
  EXPECT_EQ(changed.colorize_scene().correct_colors().proposals(), 0);
  EXPECT_EQ(ToneJson(changed).dump(), R"({"saturation":1.5,"tint":0.0,"warmth":-3.0})");
  EXPECT_EQ(ToneJson(plain).dump(), R"({"saturation":1.0,"tint":0.0,"warmth":0.0})");
  v1::JobSpec other = plain;
  other.mutable_colorize_scene()->set_key_view("b.jpg");
  EXPECT_NE(WithoutCorrections(other), WithoutCorrections(plain));
  v1::JobSpec solved = plain;
  solved.mutable_colorize_scene()->mutable_solve_chroma()->set_iterations(7);
  EXPECT_NE(WithoutCorrections(solved), WithoutCorrections(plain));
}

TEST(VersionsTest, RemoveOneFromTheMiddle) {
  v1::JobSpec spec = RunSpec();
  for (const char digit : {'1', '2', '3'}) {
    VersionChange change;
    change.add = PointsOn("a.jpg", digit);
    spec = Changed(spec, change);
  }
  const auto& corrections = spec.colorize_scene().correct_colors().corrections();
  const std::string middle = CorrectionId(corrections[1]), last = CorrectionId(corrections[2]);
  EXPECT_NE(middle, last);
  VersionChange remove;
  remove.remove = {middle};
  const v1::JobSpec without = Changed(spec, remove);
  ASSERT_EQ(without.colorize_scene().correct_colors().corrections_size(), 2);
  EXPECT_EQ(CorrectionId(without.colorize_scene().correct_colors().corrections(1)), last);
  EXPECT_THROW(Changed(without, remove), Error) << "another page has removed it";
  VersionChange all;
  for (const auto& correction : without.colorize_scene().correct_colors().corrections()) {
    all.remove.push_back(CorrectionId(correction));
  }
  EXPECT_FALSE(Changed(without, all).colorize_scene().has_correct_colors());
}

TEST(VersionsTest, RefuseWhatIsNoChange) {
  const auto read = [](const char* json) { return ReadVersionChange(nlohmann::json::parse(json)); };
  EXPECT_EQ(read(R"({"remove": ["a", "b"]})").remove.size(), 2u);
  EXPECT_EQ(read(R"({"tone": {"tint": -50}})").tint, -50.0);
  for (const char* bad : {R"({"remove": "a"})",
                          R"({"remove": [1]})",
                          R"({"tone": 3})",
                          R"({"tone": {"tint": -51}})",
                          R"({"tone": {"saturation": "1"}})",
                          R"({"tone": {"warmth": null}})"}) {
    EXPECT_THROW(read(bad), Error) << bad;
  }
}

}  // namespace
}  // namespace color3d::client
